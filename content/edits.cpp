// SPDX-License-Identifier: Apache-2.0
#include "content/edits.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "content/occluder.h"
#include "content/placement.h"
#include "content/warp.h"
#include "engine/base/error.h"
#include "engine/base/utf8.h"

namespace docent::content {
namespace {

constexpr std::size_t kMaxNameInLabel = 60;  // bytes

std::string InQuotes(const std::string& name) {
  return "'" + Shortened(name, kMaxNameInLabel) + "'";
}

// "'fox'", "'fox' and 2 others".
std::string InWords(const std::vector<std::string>& names) {
  if (names.size() == 1) return InQuotes(names.front());
  const std::size_t others = names.size() - 1;
  return InQuotes(names.front()) + " and " + std::to_string(others) + (others == 1 ? " other" : " others");
}

// The indices of these entities, ascending. Throws Error when there is none with a name, or a name comes
// twice.
std::vector<std::size_t> IndicesOf(const Scene& scene, const std::vector<std::string>& names) {
  if (names.empty()) throw Error("No object is named.");
  std::map<std::string_view, std::size_t> places;
  for (std::size_t i = 0; i < scene.entities.size(); ++i) places.emplace(scene.entities[i].name, i);
  std::set<std::size_t> indices;
  for (const std::string& name : names) {
    const auto found = places.find(name);
    if (found == places.end()) throw Error("There is no '" + name + "' in this map.");
    if (!indices.insert(found->second).second) throw Error("'" + name + "' is named twice.");
  }
  return {indices.begin(), indices.end()};
}

void RefuseLocked(const Entity& entity) {
  if (entity.locked) throw Error("'" + entity.name + "' is locked; unlock it to change it.");
}

// A change of one entity that is not locked.
SceneChange ChangeOf(const Scene& scene, const std::string& name, const std::string& verb,
                     const std::function<void(Entity*)>& change) {
  const std::size_t index = IndicesOf(scene, {name}).front();
  const Entity& before = scene.entities[index];
  RefuseLocked(before);
  Entity after = before;
  change(&after);
  return {verb + " " + InQuotes(name), {{index, before, std::move(after)}}};
}

// "'sign-1' is a signpost, which cannot be bent."
[[noreturn]] void RefuseKind(const Entity& entity, const char* why_not) {
  const bool begins_with_vowel =
      entity.kind == Entity::Kind::kImage || entity.kind == Entity::Kind::kOccluder;
  const char* const article = begins_with_vowel ? "an " : "a ";
  throw Error("'" + entity.name + "' is " + article + NameOf(entity.kind) + ", which " + why_not);
}

PlacedModel& ModelOf(Entity* entity, const char* why_not) {
  if (entity->kind != Entity::Kind::kModel) RefuseKind(*entity, why_not);
  return entity->model;
}

Trail& TrailOf(Entity* entity, const char* why_not) {
  if (entity->kind != Entity::Kind::kTrail) RefuseKind(*entity, why_not);
  return entity->trail;
}

// "fox" for "fox-2", so that copies of copies are numbered on.
std::string WithoutNumber(const std::string& name) {
  std::size_t end = name.size();
  while (end > 0 && std::isdigit(static_cast<unsigned char>(name[end - 1])) != 0) --end;
  const bool numbered = end < name.size() && end > 1 && name[end - 1] == '-';
  return numbered ? name.substr(0, end - 1) : name;
}

// Names that are used, and the first free one for a copy: "fox", "fox-2", "fox-3" …
class UsedNames {
 public:
  void Add(const std::string& name) { used_.insert(name); }
  // Returns the name for a copy of what has this name, which is used from then on.
  std::string TakeFor(const std::string& original) {
    const std::string base = WithoutNumber(original);
    std::string name = original;
    int& number = next_number_.try_emplace(base, 2).first->second;
    while (used_.contains(name)) name = base + "-" + std::to_string(number++);
    used_.insert(name);
    return name;
  }

 private:
  std::set<std::string, std::less<>> used_;
  std::map<std::string, int> next_number_;  // of each base, so that many copies take linear time
};

// Gives each entity a free name, and adds them at the end of the list. Those of one group are in a group of
// their own, apart from the entities that are there.
SceneChange AddCopies(const Scene& scene, std::vector<Entity> copies, const std::string& label) {
  UsedNames names, groups;
  for (const Entity& entity : scene.entities) {
    names.Add(entity.name);
    groups.Add(entity.group);
  }
  std::map<std::string, std::string> group_of_copies;  // By the group of the originals.
  SceneChange change{label, {}};
  std::size_t index = scene.entities.size();
  for (Entity& copy : copies) {
    copy.name = names.TakeFor(copy.name);
    if (!copy.group.empty()) {
      const auto [group, is_new] = group_of_copies.try_emplace(copy.group);
      if (is_new) group->second = groups.TakeFor(copy.group);
      copy.group = group->second;
    }
    copy.locked = copy.hidden = false;
    change.entities.push_back({index++, std::nullopt, std::move(copy)});
  }
  return change;
}

// An offset that puts a copy beside its original.
Eigen::Vector3d BesideOffset(const Entity& entity) {
  constexpr double kGap = 1.1;  // Ratio of the width.
  switch (entity.kind) {
    case Entity::Kind::kSignpost:
      return kGap * entity.signpost.height * entity.signpost.up.unitOrthogonal();
    case Entity::Kind::kLabel:
      return 2 * kGap * entity.label.text_height * entity.label.up;
    case Entity::Kind::kSound:
      return {0.1 * kGap * entity.sound.range, 0, 0};
    case Entity::Kind::kTrail:
      return kGap * entity.trail.width * (PoseOf(entity).rotation * Eigen::Vector3d::UnitX());
    case Entity::Kind::kOccluder: {
      const OccluderMesh mesh = MeshOf(entity.occluder);
      double left = 0, right = 0;
      for (const Eigen::Vector3d& vertex : mesh.vertices) {
        left = std::min(left, vertex.x());
        right = std::max(right, vertex.x());
      }
      const engine::Sim3& pose = entity.occluder.map_from_shape;
      return pose.rotation * Eigen::Vector3d(kGap * pose.scale * (right - left), 0, 0);
    }
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
      break;
  }
  const engine::Sim3& pose = entity.model.map_from_model;
  const auto& model = entity.model.asset->model;
  const double width_m = model ? static_cast<double>(model->bounds_max.x - model->bounds_min.x) : 1.0;
  return pose.rotation * Eigen::Vector3d(kGap * pose.scale * width_m, 0, 0);
}

}  // namespace

SceneChange AddEdit(const Scene& scene, Entity entity) {
  if (scene.Find(entity.name) != nullptr)
    throw Error("There is already a '" + entity.name + "' in this map.");
  const std::string label = "add " + InQuotes(entity.name);
  return {label, {{scene.entities.size(), std::nullopt, std::move(entity)}}};
}

SceneChange PasteEdit(const Scene& scene, std::vector<Entity> entities) {
  if (entities.empty()) throw Error("There is nothing to paste.");
  std::vector<std::string> names;
  for (const Entity& entity : entities) names.push_back(entity.name);
  return AddCopies(scene, std::move(entities), "paste " + InWords(names));
}

SceneChange DuplicateEdit(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<Entity> copies;
  for (const std::size_t index : IndicesOf(scene, names)) {
    Entity copy = scene.entities[index];
    engine::Sim3 motion;
    motion.translation = BesideOffset(copy);
    TransformBy(motion, &copy);
    copies.push_back(std::move(copy));
  }
  return AddCopies(scene, std::move(copies), "duplicate " + InWords(names));
}

SceneChange RemoveEdit(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<std::size_t> indices = IndicesOf(scene, names);
  std::reverse(indices.begin(), indices.end());  // The others keep their indices.
  SceneChange change{"remove " + InWords(names), {}};
  for (const std::size_t index : indices) {
    RefuseLocked(scene.entities[index]);
    change.entities.push_back({index, scene.entities[index], std::nullopt});
  }
  return change;
}

SceneChange MoveEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& position_in_map) {
  return ChangeOf(scene, name, "move", [&](Entity* entity) {
    engine::Sim3 motion;
    motion.translation = position_in_map - PlaceOf(*entity);
    if (entity->kind == Entity::Kind::kTrail) return TransformBy(motion, entity);
    engine::Sim3 pose = PoseOf(*entity);  // To the last bit at the position.
    pose.translation = position_in_map;
    SetPose(pose, entity);
  });
}

SceneChange RotateEdit(const Scene& scene, const std::string& name, double angle_deg) {
  return ChangeOf(scene, name, "rotate", [&](Entity* entity) {
    if (!(std::abs(angle_deg) <= kMaxAngle_deg))
      throw Error("'" + name + "' cannot be rotated: the angle must be at most " +
                  std::to_string(std::lround(kMaxAngle_deg)) + " degrees.");
    if (entity->kind == Entity::Kind::kSignpost || entity->kind == Entity::Kind::kLabel)
      RefuseKind(*entity, "always faces the reader and cannot be rotated.");
    if (entity->kind == Entity::Kind::kSound) RefuseKind(*entity, "has no direction and cannot be rotated.");
    const Eigen::Vector3d base = BaseInMap(*entity);
    engine::Sim3 pose = PoseOf(*entity);
    pose.rotation = pose.rotation *
                    engine::Rotation3::Exp(Eigen::Vector3d::UnitY() * (angle_deg * std::numbers::pi / 180));
    SetPose(pose, entity);
    if (HasModel(*entity)) entity->model.map_from_model.translation += base - BaseInMap(*entity);
  });
}

SceneChange ScaleEdit(const Scene& scene, const std::string& name, double factor) {
  return ChangeOf(scene, name, "scale", [&](Entity* entity) {
    const Eigen::Vector3d base = BaseInMap(*entity);
    engine::Sim3 pose = PoseOf(*entity);
    pose.scale *= factor;
    SetPose(pose, entity);
    if (HasModel(*entity)) entity->model.map_from_model.translation += base - BaseInMap(*entity);
  });
}

SceneChange TransformEdit(const Scene& scene, const std::string& name, const engine::Sim3& map_from_entity) {
  return ChangeOf(scene, name, "move", [&](Entity* entity) { SetPose(map_from_entity, entity); });
}

SceneChange AlignEdit(const Scene& scene, const std::string& name,
                      std::span<const Correspondence> correspondences, Alignment* alignment) {
  return ChangeOf(scene, name, "align", [&](Entity* entity) {
    PlacedModel& model = ModelOf(entity, "cannot be aligned.");
    std::vector<Correspondence> drawn(correspondences.begin(), correspondences.end());
    if (model.warp) {
      for (Correspondence& pair : drawn) pair.in_model = (*model.warp)(pair.in_model);
    }
    const Alignment found = AlignModel(drawn);
    model.map_from_model = found.map_from_model;
    if (alignment != nullptr) *alignment = found;
  });
}

SceneChange BendEdit(const Scene& scene, const std::string& name,
                     std::span<const Correspondence> correspondences) {
  return ChangeOf(scene, name, "bend", [&](Entity* entity) {
    PlacedModel& model = ModelOf(entity, "cannot be bent.");
    model.warp = std::make_shared<Warp>(FitWarp(correspondences, model.map_from_model));
  });
}

SceneChange UnbendEdit(const Scene& scene, const std::string& name) {
  return ChangeOf(scene, name, "unbend", [&](Entity* entity) {
    PlacedModel& model = ModelOf(entity, "is not bent.");
    if (!model.warp) throw Error("'" + name + "' is not bent.");
    model.warp.reset();
  });
}

SceneChange RenameEdit(const Scene& scene, const std::string& name, const std::string& new_name) {
  SceneChange change = ChangeOf(scene, name, "rename", [&](Entity* entity) { entity->name = new_name; });
  if (scene.Find(new_name) != nullptr) throw Error("There is already a '" + new_name + "' in this map.");
  return change;
}

SceneChange TextEdit(const Scene& scene, const std::string& name, const std::string& text,
                     const std::string& language) {
  return ChangeOf(scene, name, "change the text of", [&](Entity* entity) {
    if (TextOf(entity) == nullptr) RefuseKind(*entity, "has no text.");
    if (language.empty()) {
      *TextOf(entity) = text;
      return;
    }
    const std::string tag = LanguageTag(language);
    if (tag.empty()) throw Error("'" + Shortened(language, kMaxLanguageBytes) + "' is not a language tag.");
    if (!text.empty()) {
      (*TranslationsOf(entity))[tag] = text;
    } else if (TranslationsOf(entity)->erase(tag) == 0) {
      throw Error("'" + name + "' has no text in '" + tag + "'.");
    }
  });
}

SceneChange TargetEdit(const Scene& scene, const std::string& name, const std::string& to_map,
                       std::uint64_t to_key) {
  return ChangeOf(scene, name, "change the target of", [&](Entity* entity) {
    if (entity->kind != Entity::Kind::kSignpost) RefuseKind(*entity, "cannot lead to a map.");
    Signpost& signpost = entity->signpost;
    const bool is_same = to_key != 0 ? to_key == signpost.to_key : to_map == signpost.to_map;
    if (!is_same) signpost.direction.reset();
    signpost.to_map = to_map;
    signpost.to_key = to_key;
  });
}

SceneChange DirectionEdit(const Scene& scene, const std::string& name,
                          const std::optional<Eigen::Vector3d>& direction_in_map) {
  return ChangeOf(scene, name, "change the direction of", [&](Entity* entity) {
    if (entity->kind != Entity::Kind::kSignpost) RefuseKind(*entity, "has no arrow.");
    if (direction_in_map && !(direction_in_map->norm() > 0 && direction_in_map->allFinite()))
      throw Error("'" + name + "' cannot point in a direction without length.");
    entity->signpost.direction.reset();
    if (direction_in_map) entity->signpost.direction = direction_in_map->stableNormalized();
  });
}

SceneChange OffsetEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& offset_in_map) {
  return ChangeOf(scene, name, "move the board of", [&](Entity* entity) {
    if (entity->kind != Entity::Kind::kLabel) RefuseKind(*entity, "has no board beside it.");
    entity->label.offset = offset_in_map;
  });
}

SceneChange AddPointEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& point_in_map) {
  return ChangeOf(scene, name, "add a point to",
                  [&](Entity* entity) { TrailOf(entity, "has no points.").points.push_back(point_in_map); });
}

SceneChange RemovePointEdit(const Scene& scene, const std::string& name) {
  return ChangeOf(scene, name, "remove a point of", [&](Entity* entity) {
    Trail& trail = TrailOf(entity, "has no points.");
    if (trail.points.size() <= kMinTrailPoints)
      throw Error("'" + name + "' cannot have fewer points; remove it instead.");
    trail.points.pop_back();
  });
}

SceneChange SizeEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& size) {
  return ChangeOf(scene, name, "resize", [&](Entity* entity) {
    if (entity->kind != Entity::Kind::kOccluder) RefuseKind(*entity, "has no sides; scale it instead.");
    Occluder& occluder = entity->occluder;
    if (occluder.shape == Occluder::Shape::kPolygon)
      throw Error("'" + name + "' is a polygon, which has the size of its corners; scale it instead.");
    occluder.size = size;
    if (occluder.shape == Occluder::Shape::kPlane) occluder.size.z() = 0;
    if (occluder.shape == Occluder::Shape::kCylinder) occluder.size.z() = size.x();
  });
}

SceneChange FlagEdit(const Scene& scene, const std::vector<std::string>& names, EntityFlag flag, bool value) {
  const bool is_lock = flag == EntityFlag::kLocked;
  SceneChange change{
      std::string(is_lock ? (value ? "lock " : "unlock ") : (value ? "hide " : "show ")) + InWords(names),
      {}};
  for (const std::size_t index : IndicesOf(scene, names)) {
    const Entity& before = scene.entities[index];
    if ((is_lock ? before.locked : before.hidden) == value) continue;
    if (!is_lock) RefuseLocked(before);
    Entity after = before;
    (is_lock ? after.locked : after.hidden) = value;
    change.entities.push_back({index, before, std::move(after)});
  }
  if (change.entities.empty()) {
    throw Error(InWords(names) + (names.size() == 1 ? " is" : " are") + (value ? " already " : " not ") +
                (is_lock ? "locked." : "hidden."));
  }
  return change;
}

SceneChange GroupEdit(const Scene& scene, const std::vector<std::string>& names, const std::string& group) {
  SceneChange change{(group.empty() ? "ungroup " : "group ") + InWords(names), {}};
  for (const std::size_t index : IndicesOf(scene, names)) {
    const Entity& before = scene.entities[index];
    RefuseLocked(before);
    if (before.group == group) continue;
    Entity after = before;
    after.group = group;
    change.entities.push_back({index, before, std::move(after)});
  }
  if (change.entities.empty()) {
    throw Error(InWords(names) + (names.size() == 1 ? " is" : " are") +
                (group.empty() ? " in no group." : " already in this group."));
  }
  return change;
}

SceneChange SettingsEdit(const Scene& scene, const MapSettings& settings, std::string label) {
  if (settings == scene.settings) throw Error("Nothing would change.");
  return {std::move(label), {}, SettingsChange{scene.settings, settings}};
}

}  // namespace docent::content
