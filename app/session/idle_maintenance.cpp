// SPDX-License-Identifier: Apache-2.0
#include "app/session/idle_maintenance.h"

#include <memory>
#include <optional>
#include <string>

#include "app/files/text_file.h"
#include "app/session/library_scene.h"
#include "maps/maintenance/densify.h"
#include "maps/maintenance/maintenance.h"
#include "maps/storage/checksum.h"

namespace docent::app {

bool IdleMaintenance::IsIdle(const SessionMap& map) const {
  // Content that could not be read would not move along.
  return map.Exists() && map.snapshot && !map.NeedsSave() && maps::MayChangeStructure(map.policy) &&
         !map.content_left_out && !system_.IsInUse(map.key);
}

std::vector<IdleMap> IdleMaintenance::MapsToAdjust() const {
  std::vector<IdleMap> idle;
  for (const auto& [key, map] : state_.maps) {
    if (IsIdle(map) && map.maintained_revision != map.snapshot->revision)
      idle.push_back({key, map.name, map.snapshot, map.changed});
  }
  return idle;
}

// Returns the map if it is still idle and unchanged.
SessionMap* IdleMaintenance::FindIdleMap(const IdleMap& idle) {
  SessionMap* const map = state_.FindMap(idle.key);
  return map != nullptr && IsIdle(*map) && map->snapshot == idle.snapshot ? map : nullptr;
}

// Surfaces are computed last, since an adjustment may move them.
std::optional<IdleMap> IdleMaintenance::MapToMesh() const {
  if (!with_meshes_) return std::nullopt;
  for (const auto& [key, map] : state_.maps) {
    if (IsIdle(map) && map.meshed_revision != map.snapshot->revision && !map.HasCurrentMesh())
      return IdleMap{key, map.name, map.snapshot, map.changed};
  }
  return std::nullopt;
}

bool IdleMaintenance::Run(const std::atomic<bool>& interrupt) {
  std::vector<IdleMap> idle;
  std::optional<IdleMap> without_mesh;
  {
    const std::scoped_lock lock(mutex_);
    if (!system_.IsMapperIdle()) return false;
    idle = MapsToAdjust();
    if (idle.empty()) without_mesh = MapToMesh();
  }
  if (without_mesh) return ComputeMesh(*without_mesh, interrupt);
  const std::optional<IdleMap> chosen = order_.Next(idle, interrupt);
  return chosen && Adjust(*chosen, interrupt);
}

bool IdleMaintenance::ComputeMesh(const IdleMap& chosen, const std::atomic<bool>& interrupt) {
  if (!unfinished_ || unfinished_->map() != chosen.snapshot) unfinished_.emplace(chosen.snapshot);
  std::optional<engine::MapMesh> mesh = unfinished_->Run({}, &interrupt);
  if (!mesh) return false;
  unfinished_.reset();
  std::shared_ptr<const engine::MapMesh> fitting;
  std::shared_ptr<const engine::LightEstimate> light;
  if (!mesh->mesh.empty()) {
    fitting = std::make_shared<const engine::MapMesh>(maps::MeshThatFits(*std::move(mesh)));
    if (with_light_) light = LightOn(*chosen.snapshot, *fitting);
  }
  {
    const std::scoped_lock lock(mutex_);
    SessionMap* const map = state_.FindMap(chosen.key);
    if (map == nullptr) return true;
    // Once per revision, also if it cannot be saved because the disk is full.
    map->meshed_revision = chosen.snapshot->revision;
    if (fitting) map->SetMesh(fitting, std::move(light));
  }
  if (fitting) library_->SaveMesh(chosen.key, *fitting);
  return true;
}

bool IdleMaintenance::Adjust(const IdleMap& chosen, const std::atomic<bool>& interrupt) {
  std::shared_ptr<const content::Scene> scene;
  content::EditHistory history;
  std::string name;
  std::uint64_t stored_scene = 0;
  const maps::AdjustedMap adjusted = maps::AdjustIdleMap(*chosen.snapshot, &interrupt);
  const maps::Optimization& done = adjusted.optimization;
  if (done.outcome == maps::Optimization::Outcome::kInterrupted) return false;
  {
    const std::scoped_lock lock(mutex_);
    SessionMap* const map = FindIdleMap(chosen);
    if (map == nullptr) return false;
    // Once per revision, whatever the outcome.
    map->maintained_revision = chosen.snapshot->revision;
    scene = map->scene;
    history = map->history;
    name = map->name;
    stored_scene = map->stored_scene;
  }
  if (!adjusted.snapshot) return true;
  maps::MapRecord record;
  record.key = chosen.key;
  record.name = name;
  record.snapshot = adjusted.snapshot;
  record.expected_revision = chosen.snapshot->revision;
  // Content that another program has saved meanwhile would be lost, or would stay where its anchors were.
  record.expected_scene = stored_scene;
  ContentFollower follower;
  std::shared_ptr<const content::Scene> moved = scene;
  if (MoveContent(*chosen.snapshot, *adjusted.snapshot, &follower, &moved, &history)) {
    record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(*moved));
    record.history = std::make_shared<maps::SceneRecord>(RecordFromHistory(history, *moved));
  }
  if (!library_->Save(record)) return true;
  const std::scoped_lock lock(mutex_);
  SessionMap* const map = FindIdleMap(chosen);
  if (map == nullptr || map->scene != scene || map->name != name ||
      !system_.ReplaceSnapshot(map->key, chosen.snapshot, adjusted.snapshot)) {
    // A camera entered the map meanwhile, or its content was changed and may have been saved before the
    // adjusted map: the session continues with the map as it was, and saves that.
    if (SessionMap* const kept = state_.FindMap(chosen.key)) {
      kept->saved_snapshot = adjusted.snapshot;
      kept->saved_scene.reset();
    }
    return true;
  }
  map->UpdateSnapshot(adjusted.snapshot);
  map->saved_snapshot = adjusted.snapshot;
  if (record.scene) map->stored_scene = maps::SceneTextChecksum(record.scene->text);
  map->maintained_revision = adjusted.snapshot->revision;
  state_.AddEvent(state_.LastTime(), "maintenance",
                  map->name + ": reprojection error " + FormatNumber(done.rms_before_px, 3) + " px before, " +
                      FormatNumber(done.rms_after_px, 3) + " px after");
  return true;
}

}  // namespace docent::app
