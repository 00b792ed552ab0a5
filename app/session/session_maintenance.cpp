// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "app/files/text_file.h"
#include "app/session/session.h"
#include "maps/maintenance.h"

// What is done for maps that nobody is in (ptamm §3.1: a map maker that roves), on the saver's thread, while
// nothing waits to be saved and the mapper of the present map has nothing to do.
namespace docent::app {

namespace {

// Whoever holds the lock may wait for a save, which then interrupts: so that this one never waits for good.
std::unique_lock<std::mutex> LockUnless(const std::atomic<bool>& interrupt, std::mutex* mutex) {
  std::unique_lock lock(*mutex, std::defer_lock);
  while (!interrupt && !lock.try_lock()) std::this_thread::sleep_for(std::chrono::microseconds(200));
  return lock;
}

}  // namespace

bool Session::IsIdle(const SessionMap& map) const {
  const bool used = std::any_of(cameras_.begin(), cameras_.end(),
                                [&](const Camera& camera) { return camera.map_key == map.key; });
  const bool joined = joining_ && joining_->from == map.key;
  return !used && !joined && map.key != extended_key_ && map.IsActive() && map.snapshot && !map.NeedsSave() &&
         maps::MayChangeStructure(map.policy);
}

std::vector<IdleMap> Session::MapsForMaintenance() const {
  std::vector<IdleMap> resting;
  for (const auto& [key, map] : maps_) {
    if (IsIdle(map) && map.upkept_revision != map.snapshot->revision)
      resting.push_back({key, map.name, map.snapshot, map.changed});
  }
  return resting;
}

// The map, as long as it still rests as it did.
SessionMap* Session::FindIdleMap(const IdleMap& resting) {
  const auto found = maps_.find(resting.key);
  if (found == maps_.end() || !IsIdle(found->second) || found->second.snapshot != resting.snapshot)
    return nullptr;
  return &found->second;
}

bool Session::RunMaintenance(const std::atomic<bool>& interrupt) {
  std::vector<IdleMap> resting;
  {
    const auto lock = LockUnless(interrupt, &mutex_);
    if (!lock || !mapping_.Resting()) return false;
    resting = MapsForMaintenance();
  }
  std::shared_ptr<const content::Scene> scene;
  const std::optional<IdleMap> chosen = maintenance_order_.Next(resting, interrupt);
  if (!chosen) return false;
  const maps::AdjustedMap adjusted = maps::AdjustIdleMap(*chosen->snapshot, &interrupt);
  const maps::Optimization& done = adjusted.optimization;
  if (done.outcome == maps::Optimization::Outcome::kInterrupted) return false;
  {
    const auto lock = LockUnless(interrupt, &mutex_);
    SessionMap* const map = lock ? FindIdleMap(*chosen) : nullptr;
    if (map == nullptr) return false;
    // Whatever becomes of it: once is enough.
    map->upkept_revision = chosen->snapshot->revision;
    scene = map->scene;
  }
  if (!adjusted.snapshot) return true;
  maps::MapRecord record;
  record.key = chosen->key;
  record.name = chosen->name;
  record.snapshot = adjusted.snapshot;
  record.over_revision = chosen->snapshot->revision;
  const auto motions = ContentFollower().Follow(*scene, *chosen->snapshot, *adjusted.snapshot);
  if (!motions.empty())
    record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(*Moved(*scene, motions)));
  if (!library_->Save(record)) return true;
  const auto lock = LockUnless(interrupt, &mutex_);
  // Somebody came back meanwhile: that one goes on with the map as it was, and will save it so.
  SessionMap* const map = lock ? FindIdleMap(*chosen) : nullptr;
  if (map == nullptr) return true;
  map->Grow(adjusted.snapshot);
  map->saved_snapshot = adjusted.snapshot;
  map->upkept_revision = adjusted.snapshot->revision;
  index_.SetMap(map->key, adjusted.snapshot);
  AddEvent(LastTime(), "upkeep",
           map->name + ": " + FormatNumber(done.rms_before_px, 3) + " px before, " +
               FormatNumber(done.rms_after_px, 3) + " px after");
  return true;
}

}  // namespace docent::app
