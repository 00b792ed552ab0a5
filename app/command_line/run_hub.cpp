// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_hub.h"

#include <spdlog/spdlog.h>

#include <string>
#include <utility>

#include "app/command_line/interruption.h"

namespace docent::app {

void RunHub::Begin(Session* session) {
  if (!hub_) return;
  const auto tell = [session](const std::string& sentence) { session->AddEvent("hub", sentence); };
  if (may_write_) {
    maps::SyncOptions options = *hub_;
    options.is_stopped = [this] { return may_be_interrupted_ && Interruption::requested(); };
    pusher_.emplace(std::move(options), tell);
    told_pusher_ = &*pusher_;
    return;
  }
  maps::HubFollower::Callbacks callbacks;
  callbacks.pulled = [session](const maps::SyncReport& report) {
    session->ReloadContent(report.changed_keys);
  };
  callbacks.told = tell;
  maps::SyncOptions options = *hub_;
  options.near_key = [this] { return visited_map_.load(); };
  follower_.emplace(std::move(options), std::move(callbacks));
}

void RunHub::FinishPushing() {
  if (!pusher_) return;
  // What has ended the session is not meant for its last changes.
  may_be_interrupted_ = !Interruption::requested();
  const bool is_complete = pusher_->Finish([] {
    spdlog::warn(
        "The last changes are being sent to the hub; Ctrl-C ends that and leaves them in the library.");
  });
  if (is_complete) return;
  spdlog::warn(
      "Not all changes are on the hub. They are saved in the library; send them with docent maps push.");
}

void RunHub::LibraryWasSaved() {
  if (maps::HubPusher* const pusher = told_pusher_.load()) pusher->LibraryWasSaved();
}

}  // namespace docent::app
