// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "content/alignment.h"
#include "content/edit_history.h"

// The changes that people make to a scene. Commands of people and scripts are app/script/commands.h, which
// the session turns into these; command line tools use them for stored scenes. A scene is changed in no other
// way by people.
//
// Each function returns the change and leaves the scene as it is; EditHistory::Do or ApplyChange applies it.
// They throw Error with one sentence when the edit does not fit the scene: an entity does not exist, is named
// twice, is locked, or is of the wrong kind. What could not be stored is refused where the change is applied.
// Pure functions; thread-safe.
namespace docent::content {

// The entity's name must be unused (Scene::FreeName).
SceneChange AddEdit(const Scene& scene, Entity entity);
// Copies of these entities, which may be from another scene, are added under free names. They are neither
// locked nor hidden. Copies from one group are together in a group of their own, whose name is free.
SceneChange PasteEdit(const Scene& scene, std::vector<Entity> entities);
// Copies of entities of this scene in the same way, each beside its original.
SceneChange DuplicateEdit(const Scene& scene, const std::vector<std::string>& names);
SceneChange RemoveEdit(const Scene& scene, const std::vector<std::string>& names);

// To this place of the entity's origin (PlaceOf).
SceneChange MoveEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& position_in_map);
// About the up axis of a model, image, occluder or trail through its base, counter-clockwise seen from above.
// What faces the reader, and a sound, cannot be rotated.
SceneChange RotateEdit(const Scene& scene, const std::string& name, double angle_deg);
// Relative to the entity's base (BaseInMap). Of a sound, the range is multiplied.
SceneChange ScaleEdit(const Scene& scene, const std::string& name, double factor);
// The entity gets this pose (SetPose).
SceneChange TransformEdit(const Scene& scene, const std::string& name, const engine::Sim3& map_from_entity);

// Gives a model the pose that fits correspondences of points of its drawn shape, bent if it is; see
// alignment.h. `alignment` receives how well they fit; it may be null.
SceneChange AlignEdit(const Scene& scene, const std::string& name,
                      std::span<const Correspondence> correspondences, Alignment* alignment);
// Bends a model so that these points of its original shape are at their places; see warp.h.
SceneChange BendEdit(const Scene& scene, const std::string& name,
                     std::span<const Correspondence> correspondences);
// Gives a model its original shape again.
SceneChange UnbendEdit(const Scene& scene, const std::string& name);

SceneChange RenameEdit(const Scene& scene, const std::string& name, const std::string& new_name);
// Of a signpost, label or sound: its first text, or with a language (see LanguageTag) its variant in that
// language, which an empty text removes.
SceneChange TextEdit(const Scene& scene, const std::string& name, const std::string& text,
                     const std::string& language = "");
// Of a signpost. to_map empty and to_key 0: it leads nowhere. The way to another map than before is not
// known.
SceneChange TargetEdit(const Scene& scene, const std::string& name, const std::string& to_map,
                       std::uint64_t to_key);
// Of a signpost: where one leaves for that map, as a direction of any length in the map; empty if that is not
// known.
SceneChange DirectionEdit(const Scene& scene, const std::string& name,
                          const std::optional<Eigen::Vector3d>& direction_in_map);

// Of a label: where its board is, from its anchor.
SceneChange OffsetEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& offset_in_map);
// Of a trail: a further point at its end, and without the last one.
SceneChange AddPointEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& point_in_map);
SceneChange RemovePointEdit(const Scene& scene, const std::string& name);

// Of an occluder that is no polygon: width, height and depth. Of a plane and a cylinder, the depth is
// ignored.
SceneChange SizeEdit(const Scene& scene, const std::string& name, const Eigen::Vector3d& size);

// Of the map itself. Throws Error when the settings are these already.
SceneChange SettingsEdit(const Scene& scene, const MapSettings& settings, std::string label);

enum class EntityFlag { kLocked, kHidden };
// Throws Error when all of the entities have this value already.
SceneChange FlagEdit(const Scene& scene, const std::vector<std::string>& names, EntityFlag flag, bool value);
// An empty group takes the entities out of their groups.
SceneChange GroupEdit(const Scene& scene, const std::vector<std::string>& names, const std::string& group);

}  // namespace docent::content
