// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <set>
#include <stop_token>
#include <string>

#include "engine/base/worker.h"
#include "maps/hub/sync.h"

namespace docent::maps {

// Keeps a library as its hub is, in a thread of its own: it pulls once, and again whenever the hub says that
// it was changed. While the hub cannot be reached, or a map could not be pulled, it tries again, less and
// less often, and the library stays as it is. Nobody ever waits for this thread but the destructor, which
// waits until the current request is answered or has failed.
class HubFollower {
 public:
  // Called on the follower's thread. Both may be empty.
  struct Callbacks {
    std::function<void(const SyncReport& report)> pulled;  // If something was changed in the library.
    // With each sentence about what was changed in the library or could not be, unless the pull before said
    // it too. Also when the hub can no longer be reached or refuses, and when it can be reached again.
    std::function<void(const std::string& sentence)> told;
  };

  // `options` as for Pull; its is_stopped is replaced. The library must exist.
  HubFollower(SyncOptions options, Callbacks callbacks);

 private:
  void Follow(const std::stop_token& stop);
  // Pulls until the connection is lost, which throws.
  void FollowConnected(const std::stop_token& stop);
  SyncReport PullAndTell();
  void TellOf(const SyncReport& report);
  void Tell(const std::string& sentence);

  SyncOptions options_;
  Callbacks callbacks_;
  std::string told_;             // The last sentence about the hub, which is not repeated.
  std::set<std::string> lines_;  // Those of the last pull, which are not repeated.
  bool is_connected_ = false;
  Worker worker_;  // Last, because its thread uses the other members.
};

}  // namespace docent::maps
