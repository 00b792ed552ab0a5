// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>

#include "engine/base/worker.h"
#include "maps/hub/sync.h"

namespace docent::maps {

// Saves on a hub what an authoring session saves in its library, in a thread of its own: each time it is told
// that the library has changed, and again, less and less often, while the hub cannot be reached. Nobody waits
// for it but Finish, and the destructor, which waits until the current request is answered or has failed.
class HubPusher {
 public:
  // Called on the pusher's thread with each sentence about what was saved on the hub, or could not be; no
  // sentence comes twice in a row. May be empty.
  using Tell = std::function<void(const std::string& sentence)>;

  // `options` as for Push; its is_stopped is called on the pusher's thread. The library must exist. What
  // differs now is pushed too.
  HubPusher(SyncOptions options, Tell tell);
  ~HubPusher();

  // The library was saved. Any thread; never waits for the hub.
  void LibraryWasSaved();
  // Pushes what was saved and not pushed yet, in one attempt, and ends the thread. Returns whether the hub
  // has everything that it may have. Calls `takes_long`, which may be empty, once when that takes longer than
  // a second. Call it once, by the thread that made this.
  bool Finish(const std::function<void()>& takes_long = {});

 private:
  void Run(const std::stop_token& stop);
  // One attempt; returns whether nothing is left to do.
  bool PushOnce();
  void Say(const std::string& sentence);

  SyncOptions options_;
  const Tell tell_;
  std::set<std::string>
      told_;  // What the last attempt said, which is not repeated. Of the thread, as is_complete_.
  bool is_complete_ = false;  // The last attempt left nothing to do.
  std::mutex mutex_;          // Guards the members below.
  std::condition_variable_any changed_;
  bool is_due_ = true;      // Something was saved since the last attempt began.
  bool is_ending_ = false;  // Finish was called.
  Worker worker_;           // Last, because its thread uses the other members.
};

}  // namespace docent::maps
