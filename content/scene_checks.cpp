// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <set>

#include "content/occluder.h"
#include "content/scene.h"
#include "content/warp.h"
#include "engine/base/utf8.h"

// Validate and TextBytes of scene.h.
namespace docent::content {
namespace {

std::string Brief(double number) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, number, std::chars_format::general, 6).ptr};
}

bool IsIn(double number, double least, double most) {
  return number >= least && number <= most;  // false for NaN
}

std::string OutOfRange(const char* what, double number, double least, double most) {
  return std::string("would have ") + what + " of " + Brief(number) + ", which is not between " +
         Brief(least) + " and " + Brief(most);
}

// The problem of a number in its limits; empty if there is none.
std::string RangeProblem(const char* what, double number, double least, double most) {
  return IsIn(number, least, most) ? "" : OutOfRange(what, number, least, most);
}

std::string PointProblem(const Eigen::Vector3d& point) {
  for (const double coordinate : point) {
    if (!IsIn(coordinate, -kMaxCoordinate, kMaxCoordinate))
      return OutOfRange("a coordinate", coordinate, -kMaxCoordinate, kMaxCoordinate);
  }
  return "";
}

bool IsUnit(double norm) {
  return IsIn(norm, 0.9999, 1.0001);
}

std::string UpProblem(const Eigen::Vector3d& up) {
  return IsUnit(up.norm()) ? "" : "would have no valid up direction";
}

std::string DirectionProblem(const std::optional<Eigen::Vector3d>& direction) {
  return !direction || IsUnit(direction->norm()) ? "" : "would have an arrow without a valid direction";
}

std::string First(std::initializer_list<std::string> problems) {
  for (const std::string& problem : problems) {
    if (!problem.empty()) return problem;
  }
  return "";
}

std::string ModelPoseProblem(const engine::Sim3& pose) {
  return First({PointProblem(pose.translation),
                RangeProblem("a scale", pose.scale, kMinModelScale, kMaxModelScale),
                IsUnit(pose.rotation.quaternion().norm()) ? "" : "would have no valid rotation"});
}

std::string TrailProblem(const Trail& trail) {
  if (trail.points.size() < kMinTrailPoints || trail.points.size() > kMaxTrailPoints) {
    return "would have " + std::to_string(trail.points.size()) + " points, which is not between " +
           std::to_string(kMinTrailPoints) + " and " + std::to_string(kMaxTrailPoints);
  }
  for (const Eigen::Vector3d& point : trail.points) {
    if (std::string problem = PointProblem(point); !problem.empty()) return problem;
  }
  return First({RangeProblem("a width", trail.width, kMinTrailWidth, kMaxTrailWidth), UpProblem(trail.up)});
}

bool IsEntityText(const std::string& text) {
  return text.size() <= kMaxTextBytes && IsUtf8(text);
}

std::string NotText() {
  return "that is not UTF-8 text of at most " + std::to_string(kMaxTextBytes) + " bytes";
}

std::string TextProblem(const Entity& entity) {
  const std::string* const text = TextOf(entity);
  if (text == nullptr) return "";
  if (!IsEntityText(*text)) return "would have a text " + NotText();
  const Translations& translations = *TranslationsOf(entity);
  if (translations.size() > kMaxTranslations)
    return "would have a text in more than " + std::to_string(kMaxTranslations) + " languages";
  for (const auto& [language, variant] : translations) {
    if (LanguageTag(language) != language || language.empty())
      return "would have a text in a language whose tag is not valid";
    if (variant.empty() || !IsEntityText(variant))
      return "would have a text in '" + language + "' " + NotText();
  }
  return "";
}

// Of a file; one without bytes stands for any with its id.
std::string AssetProblem(const std::shared_ptr<const Asset>& asset, AssetKind kind, const char* name) {
  const bool exists = asset && !asset->id.empty() && IsEntityText(asset->id);
  if (exists && (asset->bytes.empty() || asset->kind == kind)) return "";
  return std::string("would have no ") + name;
}

std::string ModelProblem(const PlacedModel& model) {
  if (std::string problem = AssetProblem(model.asset, AssetKind::kModel, "model"); !problem.empty())
    return problem;
  if (!IsIn(model.animation, -1, kMaxAnimation)) return "would have an animation that is out of range";
  return model.warp ? Validate(*model.warp) : "";
}

std::size_t TranslationCount(const Entity& entity) {
  const Translations* const translations = TranslationsOf(entity);
  return translations != nullptr ? translations->size() : 0;
}

}  // namespace

std::string PoseProblem(const Entity& entity) {
  switch (entity.kind) {
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
      return ModelPoseProblem(entity.model.map_from_model);
    case Entity::Kind::kSignpost:
      return First({PointProblem(entity.signpost.anchor),
                    RangeProblem("a height", entity.signpost.height, kMinBoardHeight, kMaxBoardHeight),
                    UpProblem(entity.signpost.up), DirectionProblem(entity.signpost.direction)});
    case Entity::Kind::kLabel:
      return First({PointProblem(entity.label.anchor), PointProblem(entity.label.offset),
                    RangeProblem("a height", entity.label.text_height, kMinBoardHeight, kMaxBoardHeight),
                    UpProblem(entity.label.up)});
    case Entity::Kind::kSound:
      return First({PointProblem(entity.sound.position),
                    RangeProblem("a range", entity.sound.range, kMinSoundRange, kMaxSoundRange)});
    case Entity::Kind::kTrail:
      return TrailProblem(entity.trail);
    case Entity::Kind::kOccluder:
      return ModelPoseProblem(entity.occluder.map_from_shape);
  }
  return "would be of no known kind";
}

std::string Validate(const Entity& entity) {
  if (entity.name.empty()) return "would have no name";
  if (!IsEntityText(entity.name)) return "would have a name " + NotText();
  if (!IsEntityText(entity.group)) return "would be in a group with a name " + NotText();
  std::string problem = TextProblem(entity);
  if (entity.kind == Entity::Kind::kModel) problem = ModelProblem(entity.model);
  if (entity.kind == Entity::Kind::kImage) {
    problem = AssetProblem(entity.model.asset, AssetKind::kImage, "image");
    if (problem.empty() && entity.model.warp) problem = "would be a bent image";
  }
  if (entity.kind == Entity::Kind::kSignpost && !IsEntityText(entity.signpost.to_map))
    problem = "would lead to a map with a name " + NotText();
  if (entity.kind == Entity::Kind::kSound && problem.empty())
    problem = AssetProblem(entity.sound.asset, AssetKind::kSound, "sound");
  if (entity.kind == Entity::Kind::kOccluder) problem = ShapeProblem(entity.occluder);
  return problem.empty() ? PoseProblem(entity) : problem;
}

std::string Validate(const Scene& scene) {
  if (scene.entities.size() > kMaxEntities)
    return "A map can hold at most " + std::to_string(kMaxEntities) + " objects.";
  if (const std::string problem = Validate(scene.settings); !problem.empty()) return problem;
  std::set<std::string_view> names;
  SceneTally tally;
  for (const Entity& entity : scene.entities) {
    if (const std::string problem = Validate(entity); !problem.empty())
      return "'" + Shortened(entity.name, 80) + "' " + problem + ".";
    if (!names.insert(entity.name).second) return "There are two '" + entity.name + "' in this map.";
    if (const std::string problem = tally.Add(entity); !problem.empty()) return problem;
  }
  return "";
}

std::string SceneTally::Add(const Entity& entity) {
  SceneTally sum = *this;
  sum.text_bytes += TextBytes(entity);
  sum.translations += TranslationCount(entity);
  if (entity.model.warp) sum.warp_points += entity.model.warp->controls.size();
  if (entity.kind == Entity::Kind::kTrail) sum.trail_points += entity.trail.points.size();
  if (entity.kind == Entity::Kind::kOccluder) sum.trail_points += entity.occluder.outline.size();
  if (sum.warp_points > kMaxSceneWarpPoints)
    return "The models in a map can be bent by at most " + std::to_string(kMaxSceneWarpPoints) + " points.";
  if (sum.trail_points > kMaxSceneTrailPoints)
    return "The trails and polygons in a map can have at most " + std::to_string(kMaxSceneTrailPoints) +
           " points.";
  if (sum.translations > kMaxSceneTranslations)
    return "A map can hold at most " + std::to_string(kMaxSceneTranslations) + " translations.";
  if (sum.text_bytes > kMaxSceneTextBytes)
    return "The names and texts in a map can have at most " + std::to_string(kMaxSceneTextBytes) + " bytes.";
  *this = sum;
  return "";
}

std::size_t TextBytes(const Entity& entity) {
  std::size_t bytes = entity.name.size() + entity.group.size();
  if (entity.kind == Entity::Kind::kSignpost) bytes += entity.signpost.to_map.size();
  const std::string* const text = TextOf(entity);
  if (text == nullptr) return bytes;
  bytes += text->size();
  for (const auto& [language, variant] : *TranslationsOf(entity)) bytes += language.size() + variant.size();
  return bytes;
}

}  // namespace docent::content
