// SPDX-License-Identifier: Apache-2.0
#include "content/scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "content/warp.h"

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

// What is wrong with an entity's place and size, as the end of a sentence.
std::string PoseProblem(const Entity& entity) {
  for (const double coordinate : PlaceOf(entity)) {
    if (!IsIn(coordinate, -kMaxCoordinate, kMaxCoordinate))
      return OutOfRange("a coordinate", coordinate, -kMaxCoordinate, kMaxCoordinate);
  }
  if (entity.kind == Entity::Kind::kModel) {
    const engine::Sim3& pose = entity.model.map_from_model;
    if (!IsIn(pose.scale, kMinModelScale, kMaxModelScale))
      return OutOfRange("a scale", pose.scale, kMinModelScale, kMaxModelScale);
    if (!IsIn(pose.rotation.quaternion().norm(), 0.9999, 1.0001)) return "would have no valid rotation";
    return "";
  }
  const Signpost& signpost = entity.signpost;
  if (!IsIn(signpost.height_m, kMinBoardHeight, kMaxBoardHeight))
    return OutOfRange("a height", signpost.height_m, kMinBoardHeight, kMaxBoardHeight);
  if (!IsIn(signpost.up.norm(), 0.9999, 1.0001)) return "would have no valid up direction";
  return "";
}

bool IsEntityText(const std::string& text) {
  return text.size() <= kMaxTextBytes && IsUtf8(text);
}

std::string NotText() {
  return "that is not UTF-8 text of at most " + std::to_string(kMaxTextBytes) + " bytes";
}

std::string TranslationsProblem(const Translations& translations) {
  if (translations.size() > kMaxTranslations)
    return "would have a text in more than " + std::to_string(kMaxTranslations) + " languages";
  for (const auto& [language, text] : translations) {
    if (LanguageTag(language) != language || language.empty())
      return "would have a text in a language whose tag is not valid";
    if (text.empty() || !IsEntityText(text)) return "would have a text in '" + language + "' " + NotText();
  }
  return "";
}

}  // namespace

std::string Validate(const Entity& entity) {
  const auto is_text = IsEntityText;
  const std::string not_text = NotText();
  if (entity.name.empty()) return "would have no name";
  if (!is_text(entity.name)) return "would have a name " + not_text;
  if (!is_text(entity.group)) return "would be in a group with a name " + not_text;
  if (entity.kind == Entity::Kind::kModel) {
    const PlacedModel& model = entity.model;
    if (!model.asset || model.asset->id.empty() || !is_text(model.asset->id)) return "would have no model";
    if (!IsIn(model.animation, -1, kMaxAnimation)) return "would have an animation that is out of range";
    if (model.warp) {
      if (const std::string problem = Validate(*model.warp); !problem.empty()) return problem;
    }
  } else {
    if (!is_text(entity.signpost.text)) return "would have a text " + not_text;
    if (std::string problem = TranslationsProblem(entity.signpost.translations); !problem.empty())
      return problem;
    if (!is_text(entity.signpost.to_map)) return "would lead to a map with a name " + not_text;
  }
  return PoseProblem(entity);
}

Eigen::Vector3d PlaceOf(const Entity& entity) {
  return entity.kind == Entity::Kind::kModel ? entity.model.map_from_model.translation
                                             : entity.signpost.anchor;
}

void TransformBy(const engine::Sim3& motion, Entity* entity) {
  if (entity->kind == Entity::Kind::kModel) {
    entity->model.map_from_model = motion * entity->model.map_from_model;
  } else {
    entity->signpost.anchor = motion * entity->signpost.anchor;
    entity->signpost.up = motion.rotation * entity->signpost.up;
    entity->signpost.height_m *= motion.scale;
  }
}

void MoveWithAnchor(const engine::Sim3& motion, Entity* entity) {
  Entity moved = *entity;
  TransformBy(motion, &moved);
  if (PoseProblem(moved).empty()) *entity = std::move(moved);
}

const Entity* Scene::Find(const std::string& name) const {
  const auto found = std::find_if(entities.begin(), entities.end(),
                                  [&](const Entity& entity) { return entity.name == name; });
  return found == entities.end() ? nullptr : &*found;
}

std::string Scene::FreeName(const std::string& base) const {
  if (Find(base) == nullptr) return base;
  for (int number = 2;; ++number) {
    const std::string name = base + "-" + std::to_string(number);
    if (Find(name) == nullptr) return name;
  }
}

std::string Scene::FreeSignpostName() const {
  for (int number = 1;; ++number) {
    const std::string name = "sign-" + std::to_string(number);
    if (Find(name) == nullptr) return name;
  }
}

std::string Validate(const Scene& scene) {
  if (scene.entities.size() > kMaxEntities)
    return "A map can hold at most " + std::to_string(kMaxEntities) + " models and signposts.";
  std::set<std::string_view> names;
  std::size_t bytes = 0, warp_points = 0, translations = 0;
  for (const Entity& entity : scene.entities) {
    if (const std::string problem = Validate(entity); !problem.empty())
      return "'" + Shortened(entity.name, 80) + "' " + problem + ".";
    if (!names.insert(entity.name).second) return "There are two '" + entity.name + "' in this map.";
    bytes += TextBytes(entity);
    translations += entity.signpost.translations.size();
    if (entity.model.warp) warp_points += entity.model.warp->controls.size();
  }
  if (warp_points > kMaxSceneWarpPoints)
    return "The models in a map can be bent by at most " + std::to_string(kMaxSceneWarpPoints) + " points.";
  if (translations > kMaxSceneTranslations)
    return "A map can hold at most " + std::to_string(kMaxSceneTranslations) + " translations.";
  if (bytes > kMaxSceneTextBytes)
    return "The names and texts in a map can have at most " + std::to_string(kMaxSceneTextBytes) + " bytes.";
  return "";
}

std::size_t TextBytes(const Entity& entity) {
  std::size_t bytes =
      entity.name.size() + entity.group.size() + entity.signpost.text.size() + entity.signpost.to_map.size();
  for (const auto& [language, text] : entity.signpost.translations) bytes += language.size() + text.size();
  return bytes;
}

std::string Shortened(const std::string& text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return text;
  std::size_t end = max_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end);
}

// Well-formed byte sequences of the Unicode Standard, table 3-7: no overlong form, no surrogate, nothing
// beyond U+10FFFF.
bool IsUtf8(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : static_cast<unsigned char>(0);
  };
  for (std::size_t i = 0; i < text.size();) {
    const unsigned char first = byte(i);
    if (first < 0x80) {
      ++i;
      continue;
    }
    if (first < 0xC2 || first > 0xF4) return false;
    const std::size_t length = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    const unsigned char least = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
    const unsigned char most = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
    if (byte(i + 1) < least || byte(i + 1) > most) return false;
    for (std::size_t k = 2; k < length; ++k) {
      if ((byte(i + k) & 0xC0) != 0x80) return false;
    }
    i += length;
  }
  return true;
}

std::string NameFromFile(const std::filesystem::path& file) {
  const nlohmann::json stem(file.stem().string());
  return nlohmann::json::parse(stem.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
      .get<std::string>();
}

}  // namespace docent::content
