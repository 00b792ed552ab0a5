// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numbers>
#include <type_traits>
#include <utility>

#include "app/script/script_file.h"
#include "app/session/session.h"
#include "app/session/surface_at_pixel.h"
#include "content/asset.h"
#include "content/edits.h"
#include "content/placement.h"
#include "engine/base/error.h"
#include "engine/map/upright_axes.h"

namespace docent::app {

namespace {

const content::Entity& FindEntity(const content::Scene& scene, const std::string& name) {
  const content::Entity* entity = scene.Find(name);
  if (entity == nullptr) throw Error("there is no '" + name + "' in this map");
  return *entity;
}

}  // namespace

void Session::Execute(const Command& command, const engine::TrackedFrame& frame,
                      const std::filesystem::path& model_folder) {
  if (!options_.may_write && !std::holds_alternative<UseMap>(command)) {
    throw Error("a tour is read-only; use docent author to make changes");
  }
  if (const std::string problem = Validate(command); !problem.empty()) throw Error(problem);
  LoadIntoMemory(command);
  std::unique_lock lock(mutex_);
  HandleSystemEvents();
  model_folder_ = model_folder;
  const auto apply = [&](const auto& chosen) {
    if constexpr (std::is_same_v<decltype(chosen), const SetPolicy&>) {
      Apply(chosen, frame, &lock);
    } else {
      Apply(chosen, frame);
    }
  };
  std::visit(apply, command);
  HandleSystemEvents();
  AddEvent(frame.frame.time, "command", FormatCommand(command));
}

void Session::Preload(const Command& command, const std::filesystem::path& model_folder) {
  const auto* place = std::get_if<PlaceModel>(&command);
  if (place == nullptr) return;
  const std::scoped_lock lock(mutex_);
  model_folder_ = model_folder;
  LoadAsset(place->file);
}

std::shared_ptr<const content::Asset> Session::LoadAsset(const std::string& file) {
  auto& model = models_[(model_folder_ / file).string()];
  if (model) return model;
  std::filesystem::path path = model_folder_ / file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) path = file;
  auto asset = std::make_shared<content::Asset>(content::ImportAsset(path));
  // The same bytes may already be in use in a map: one copy is shared.
  auto& kept = assets_[asset->id];
  if (!kept) kept = std::move(asset);
  return model = kept;
}

SessionMap* Session::FindByName(const std::string& name) {
  for (auto& [key, map] : maps_) {
    if (map.Exists() && map.name == name) return &map;
  }
  return nullptr;
}

SessionMap& Session::AddMap(std::uint64_t key, const std::string& name) {
  SessionMap& map = maps_[key];
  map.key = key;
  map.name = name;
  map.changed = true;
  return map;
}

std::uint64_t Session::CurrentMap(const engine::TrackedFrame& frame) const {
  return system_.CurrentMap(static_cast<std::size_t>(frame.frame.camera));
}

engine::MapPermissions Session::PermissionsOf(const SessionMap& map) const {
  engine::MapPermissions permissions;
  permissions.extend = !map.stopped && maps::MayChangeStructure(map.policy);
  if (map.policy == maps::Policy::kBounded) {
    permissions.bounds.emplace();  // empty: a bounded map without bounds accepts no keyframe
    if (map.bounds) permissions.bounds.emplace(map.bounds->min, map.bounds->max);
  }
  permissions.join = map.policy == maps::Policy::kOpen;
  // A map that was saved or that has content is kept in any case.
  permissions.discard = !map.saved_snapshot && map.scene->entities.empty();
  return permissions;
}

void Session::UpdatePermissions(const SessionMap& map) {
  system_.SetPermissions(map.key, PermissionsOf(map));
}

void Session::Apply(const NewMap& command, const engine::TrackedFrame& frame) {
  if (FindByName(command.name) != nullptr) throw Error("there is already a map '" + command.name + "'");
  const SessionMap& map = AddMap(keys_.Take(), command.name);  // first, because it may throw
  system_.StartMap(map.key, static_cast<std::size_t>(frame.frame.camera));
}

void Session::Apply(const StopMap&, const engine::TrackedFrame& frame) {
  const std::uint64_t key = CurrentMap(frame);
  const auto found = maps_.find(key);
  if (found == maps_.end()) throw Error("there is no current map to stop");
  found->second.stopped = true;
  UpdatePermissions(found->second);
  system_.LeaveMap(key);
}

void Session::Apply(const UseMap& command, const engine::TrackedFrame& frame) {
  SessionMap* map = FindByName(command.name);
  if (map == nullptr) throw Error("there is no map '" + command.name + "'");
  if (!map->snapshot) throw Error("the map '" + command.name + "' is not initialized yet");
  map->stopped = false;
  UpdatePermissions(*map);
  system_.EnterMap(map->key, static_cast<std::size_t>(frame.frame.camera));
  PinMapsInUse();
}

void Session::Apply(const SetPolicy& command, const engine::TrackedFrame& frame,
                    std::unique_lock<std::mutex>* lock) {
  SessionMap* const map = FindByName(command.name);
  if (map == nullptr) throw Error("there is no map '" + command.name + "'");
  if (!map->snapshot) throw Error("the map '" + command.name + "' is not initialized yet");
  const std::uint64_t key = map->key;
  const auto extend_again = [&] {
    UpdatePermissions(maps_.at(key));
    if (CurrentMap(frame) == key) system_.Activate(key);
  };
  if (saver_ && CurrentMap(frame) == key) {
    // The mapper must not change the map between the save and the new policy, which may forbid to save it.
    engine::MapPermissions unchanged = PermissionsOf(*map);
    unchanged.extend = false;
    system_.SetPermissions(key, unchanged);
    system_.Activate(key);
    HandleSystemEvents();
  }
  try {
    ChangePolicy(command, key, frame.frame.time, lock);
  } catch (...) {
    extend_again();
    throw;
  }
  extend_again();
}

// Releases the lock while the disk works: the saver's thread takes it too, and no frame shall wait for a
// disk.
void Session::ChangePolicy(const SetPolicy& command, std::uint64_t key, Timestamp time,
                           std::unique_lock<std::mutex>* lock) {
  SessionMap& map = maps_.at(key);
  if (saver_) {
    // The library computes the bounds from what it holds, so everything must be saved first. This is the one
    // command that waits for the disk.
    SaveMap(&map, time);
    lock->unlock();
    saver_->Flush();
    lock->lock();
    ReportSaveFailure(time);
    if (!map.Exists()) throw Error("the map '" + command.name + "' was discarded or joined meanwhile");
    if (map.NeedsSave())
      throw Error("the map '" + map.name + "' could not be saved, so its policy was not changed");
    library_->SetPolicy(key, command.policy);
    map.bounds = library_->Find(key).bounds;
  } else if (command.policy != maps::Policy::kBounded) {
    map.bounds.reset();
  } else if (!map.bounds) {
    map.bounds = maps::ComputeBounds(*map.snapshot);
  }
  map.policy = command.policy;
}

SessionMap& Session::MapToEdit(const engine::TrackedFrame& frame) {
  const std::uint64_t key = engine::HasPose(frame.state) ? frame.map_key : CurrentMap(frame);
  const auto found = maps_.find(key);
  if (found == maps_.end() || !found->second.snapshot) throw Error("there is no current map");
  if (found->second.discarded) throw Error("the map of this frame was discarded");
  if (!found->second.Exists()) throw Error("the map of this frame was joined into another one");
  if (!maps::MayChangeContent(found->second.policy)) {
    throw Error("the map '" + found->second.name + "' is " + maps::ToString(found->second.policy) +
                ": its content cannot be changed");
  }
  return found->second;
}

void Session::Edit(SessionMap* map, content::SceneChange change) {
  auto scene = std::make_shared<content::Scene>(*map->scene);
  map->history.Do(std::move(change), scene.get());
  map->scene = std::move(scene);
  UpdatePermissions(*map);
}

void Session::Apply(const PlaceModel& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const Camera& camera = cameras_.at(static_cast<std::size_t>(frame.frame.camera));
  const content::SurfaceHit hit = SurfaceAtPixel(frame, *camera.model, command.pixel);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.name = map.scene->FreeName(content::NameFromFile(command.file));
  entity.model.asset = LoadAsset(command.file);
  entity.model.map_from_model = content::UprightPose(hit.point, hit.normal, engine::UpInMap(*frame.map),
                                                     command.yaw_deg * std::numbers::pi / 180, command.scale);
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void Session::Apply(const PlaceSignpost& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const Camera& camera = cameras_.at(static_cast<std::size_t>(frame.frame.camera));
  const content::SurfaceHit hit = SurfaceAtPixel(frame, *camera.model, command.pixel);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kSignpost;
  entity.name = map.scene->FreeSignpostName();
  entity.signpost.text = command.text;
  entity.signpost.anchor = hit.point;
  entity.signpost.up = engine::UpInMap(*frame.map);
  // Map units mean nothing to the user, so the size is chosen by the distance from the camera.
  entity.signpost.height_m = options_.signpost_height * (frame.camera_from_map * hit.point).norm();
  entity.signpost.to_map = command.to_map;
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void Session::Apply(const MoveEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  Eigen::Vector3d place = content::PlaceOf(FindEntity(*map.scene, command.name));
  if (command.to_pixel) {
    const Camera& camera = cameras_.at(static_cast<std::size_t>(frame.frame.camera));
    place = SurfaceAtPixel(frame, *camera.model, *command.to_pixel).point;
  } else {
    place += command.by_in_map;
  }
  Edit(&map, content::MoveEdit(*map.scene, command.name, place));
}

void Session::Apply(const RotateEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  Edit(&map, content::RotateEdit(*map.scene, command.name, command.angle_deg));
}

void Session::Apply(const ScaleEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  Edit(&map, content::ScaleEdit(*map.scene, command.name, command.factor));
}

void Session::Apply(const RemoveEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  Edit(&map, content::RemoveEdit(*map.scene, {command.name}));
}

void Session::Apply(const Undo&, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  auto scene = std::make_shared<content::Scene>(*map.scene);
  if (!map.history.Undo(scene.get())) throw Error("there is nothing to undo in '" + map.name + "'");
  map.scene = std::move(scene);
  UpdatePermissions(map);
}

void Session::Apply(const Redo&, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  auto scene = std::make_shared<content::Scene>(*map.scene);
  if (!map.history.Redo(scene.get())) throw Error("there is nothing to redo in '" + map.name + "'");
  map.scene = std::move(scene);
  UpdatePermissions(map);
}

void Session::Apply(const Save&, const engine::TrackedFrame& frame) {
  if (!saver_) throw Error("there is no library to save to");
  for (auto& [key, map] : maps_) SaveMap(&map, frame.frame.time);
}

}  // namespace docent::app
