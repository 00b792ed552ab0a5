// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "app/session/session.h"
#include "maps/hub/hub_follower.h"
#include "maps/hub/hub_pusher.h"

namespace docent::app {

// The hub of one run: an author's saves are pushed to it, a tour's library follows it. Without a hub, nothing
// happens. It must outlive the session, whose threads tell it of saves.
class RunHub {
 public:
  // `hub` must outlive this.
  RunHub(const std::optional<maps::SyncOptions>& hub, bool may_write) : hub_(hub), may_write_(may_write) {}

  // Starts the thread that pushes or follows. What is worth telling becomes an event of the session, which
  // must live until both functions below have been called.
  void Begin(Session* session);
  void StopFollowing() { follower_.reset(); }
  // Waits until the hub has everything, or warns that it has not. Ctrl-C ends the waiting, unless it has
  // ended the session before.
  void FinishPushing();

  // Any thread, at any time.
  void LibraryWasSaved();
  // The key of the map that is tracked; other maps near it are pulled first.
  void Visit(std::uint64_t map_key) { visited_map_ = map_key; }

 private:
  const std::optional<maps::SyncOptions>& hub_;
  const bool may_write_;
  std::atomic<bool> may_be_interrupted_ = false;
  std::optional<maps::HubFollower> follower_;
  std::optional<maps::HubPusher> pusher_;
  std::atomic<maps::HubPusher*> told_pusher_ = nullptr;  // pusher_, once it is there.
  std::atomic<std::uint64_t> visited_map_ = 0;           // 0 before the first.
};

}  // namespace docent::app
