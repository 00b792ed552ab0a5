// SPDX-License-Identifier: Apache-2.0
#include "app/session/map_commands.h"

#include "engine/base/error.h"

namespace docent::app {

void MapCommands::Apply(const NewMap& command, const engine::TrackedFrame& frame) {
  if (state_.FindByName(command.name) != nullptr)
    throw Error("there is already a map '" + command.name + "'");
  const SessionMap& map = state_.AddMap(keys_.Take(), command.name);  // first, because it may throw
  system_.StartMap(map.key, CameraOf(frame));
}

void MapCommands::Apply(const StopMap&, const engine::TrackedFrame& frame) {
  const std::uint64_t key = system_.CurrentMap(CameraOf(frame));
  SessionMap* const map = state_.FindMap(key);
  if (map == nullptr) throw Error("there is no current map to stop");
  map->stopped = true;
  system_.SetPermissions(key, map->Permissions());
  system_.LeaveMap(key);
}

void MapCommands::Apply(const UseMap& command, const engine::TrackedFrame& frame) {
  SessionMap& map = state_.InitializedMap(command.name);
  map.stopped = false;
  system_.SetPermissions(map.key, map.Permissions());
  system_.EnterMap(map.key, CameraOf(frame));
  memory_.PinMapsInUse();
}

void MapCommands::Apply(const SetPolicy& command, const engine::TrackedFrame& frame,
                        std::unique_lock<std::mutex>* lock) {
  const SessionMap& map = state_.InitializedMap(command.name);
  const std::uint64_t key = map.key;
  const auto extend_again = [&] {
    system_.SetPermissions(key, state_.maps.at(key).Permissions());
    if (system_.CurrentMap(CameraOf(frame)) == key) system_.Activate(key);
  };
  if (saving_.HasStarted() && system_.CurrentMap(CameraOf(frame)) == key) {
    // The mapper must not change the map between the save and the new policy, which may forbid to save it.
    engine::MapPermissions unchanged = map.Permissions();
    unchanged.extend = false;
    system_.SetPermissions(key, unchanged);
    system_.Activate(key);
    events_.HandleEvents();
  }
  try {
    ChangePolicy(command, key, frame.frame.time, lock);
  } catch (...) {
    extend_again();
    throw;
  }
  extend_again();
}

void MapCommands::ChangePolicy(const SetPolicy& command, std::uint64_t key, Timestamp time,
                               std::unique_lock<std::mutex>* lock) {
  SessionMap& map = state_.maps.at(key);
  if (saving_.HasStarted()) {
    // The library computes the bounds from what it holds, so everything must be saved first.
    saving_.SaveMap(&map, time);
    saving_.FlushToLibrary(key, command.name, time, lock);
    if (map.NeedsSave())
      throw Error("the map '" + map.name + "' could not be saved, so its policy was not changed");
    library_->SetPolicy(key, command.policy);
    saving_.LibraryWasChanged();
    map.bounds = library_->Find(key).bounds;
  } else if (command.policy != maps::Policy::kBounded) {
    map.bounds.reset();
  } else if (!map.bounds) {
    map.bounds = maps::ComputeBounds(*map.snapshot);
  }
  map.policy = command.policy;
}

void MapCommands::Apply(const RenameMap& command, const engine::TrackedFrame& frame,
                        std::unique_lock<std::mutex>* lock) {
  SessionMap* const map = state_.FindByName(command.name);
  if (map == nullptr) throw Error("there is no map '" + command.name + "'");
  if (command.new_name == command.name) throw Error("the map has this name already");
  if (!maps::MayChangeContent(map->policy)) {
    throw Error(map->PolicyInWords() + "; it cannot be renamed");
  }
  const bool stored = saving_.FlushToLibrary(map->key, command.name, frame.frame.time, lock);
  if (state_.FindByName(command.new_name) != nullptr)
    throw Error("there is already a map '" + command.new_name + "'");
  if (stored) {
    library_->Rename(map->key, command.new_name);
    saving_.LibraryWasChanged();
  }
  map->name = command.new_name;
  state_.Retarget(map->key, command.name, map->key, command.new_name);
}

void MapCommands::Apply(const RemoveMap& command, const engine::TrackedFrame& frame,
                        std::unique_lock<std::mutex>* lock) {
  SessionMap* const map = state_.FindByName(command.name);
  if (map == nullptr) throw Error("there is no map '" + command.name + "'");
  if (!maps::MayRemove(map->policy)) {
    throw Error(map->PolicyInWords() + "; it cannot be removed");
  }
  // The library may still have the maps that were joined into it.
  if (!map->joined_keys.empty()) saving_.SaveMap(map, frame.frame.time);
  if (saving_.FlushToLibrary(map->key, command.name, frame.frame.time, lock)) {
    library_->Remove(map->key);
    saving_.LibraryWasChanged();
  }
  map->Discard();  // before the cameras leave the map, so that it is not saved again
  system_.RemoveMap(map->key);
  state_.Retarget(map->key, command.name, 0, "");
  memory_.PinMapsInUse();
}

void MapCommands::Apply(const JoinMap& command, const engine::TrackedFrame& frame) {
  const SessionMap* const into = state_.FindMap(system_.CurrentMap(CameraOf(frame)));
  if (into == nullptr) throw Error("there is no current map to join another one to");
  const SessionMap& from = state_.InitializedMap(command.name);
  if (from.key == into->key) throw Error("'" + command.name + "' is the current map already");
  if (system_.IsInUse(from.key))
    throw Error("the map '" + from.name + "' is in use and cannot be joined now");
  for (const SessionMap* map : {&from, into}) {
    if (map->policy != maps::Policy::kOpen) throw Error(map->PolicyInWords() + "; it cannot be joined");
    if (map->content_left_out)
      throw Error("content of the map '" + map->name + "' is damaged and would be lost; it cannot be joined");
  }
  // The current map may still get depth, and is compared then.
  if (!from.snapshot->HasFinitePoints())
    throw Error("the map '" + from.name +
                "' has no depth yet and cannot be joined; move the camera sideways in it first");
  if (system_.ActiveMap() != into->key)
    throw Error("the map '" + into->name + "' is not being extended; continue it first");
  system_.JoinIntoActiveMap(from.key);
}

void MapCommands::Apply(const Save&, const engine::TrackedFrame& frame) {
  if (!saving_.HasStarted()) throw Error("there is no library to save to");
  saving_.SaveAll(frame.frame.time);
}

}  // namespace docent::app
