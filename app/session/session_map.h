// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/session/content_follower.h"
#include "app/session/initialization_monitor.h"
#include "content/edits.h"
#include "content/scene.h"
#include "engine/base/time.h"
#include "engine/map/map_snapshot.h"
#include "maps/policy.h"

namespace docent::app {

// One map as a session knows it, whether it came from the library or is being made. Owned by the session,
// which guards it; snapshots and scenes never change once they are in here, so copies of the pointers may
// leave.
struct SessionMap {
  std::uint64_t key = 0;
  std::string name;
  maps::Policy policy = maps::Policy::kOpen;
  std::optional<maps::Bounds> bounds;  // of a bounded map
  std::shared_ptr<const engine::MapSnapshot>
      snapshot;  // null while its start is looked for, or not in memory
  std::shared_ptr<const content::Scene> scene = std::make_shared<content::Scene>();  // never null
  content::EditHistory history;
  ContentFollower follower;

  // What the library holds of it, or will hold when the saver has caught up; null when never saved.
  std::shared_ptr<const engine::MapSnapshot> saved_snapshot;
  std::shared_ptr<const content::Scene> saved_scene;

  bool in_library =
      false;             // it was there when the session began: without a snapshot it is merely not in memory
  bool changed = false;  // in this session: it stays in memory until the end

  // The state that upkeep has left behind, or looked at without finding anything to do; 0 for none.
  std::uint64_t upkept_revision = 0;

  bool rests = false;  // the person stopped it: it grows no further until it is taken up again by name

  // Of a map made in this session: a start that does not hold is given up (see Session).
  bool on_probation = false;
  InitializationMonitor start_watch;  // while on_probation
  bool discarded = false;
  bool after_loss = false;  // begun because the camera was lost in another map
  Timestamp started{};      // of the frame that completed its first pair

  // See session_joining.cpp.
  std::uint64_t join_with = 0;       // the map that the camera went back to from it; 0 for none
  std::size_t join_at = 0;           // keyframes of both, from which on it is tried
  std::uint64_t joined_into = 0;     // the map that it is a part of now; 0 for none
  std::vector<std::uint64_t> holds;  // that were joined into it

  // The mapper has made this of it; what stands in it moves along with its ground.
  void Grow(std::shared_ptr<const engine::MapSnapshot> grown);

  // It is a map of its own still: neither given up nor a part of another one.
  bool IsActive() const { return !discarded && joined_into == 0; }
  bool NeedsSave() const { return snapshot && (snapshot != saved_snapshot || scene != saved_scene); }
};

}  // namespace docent::app
