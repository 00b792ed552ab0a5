// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub_pusher.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>
#include <utility>

#include "engine/base/error.h"

namespace docent::maps {

namespace {

constexpr std::chrono::milliseconds kFirstRetry(500), kLongestRetry(30'000);  // As HubFollower.
// At the end: how long nobody needs to be told why it waits.
constexpr std::chrono::milliseconds kLongWait(1000), kBetweenLooks(20);

}  // namespace

HubPusher::HubPusher(SyncOptions options, Tell tell)
    : options_(std::move(options)),
      tell_(std::move(tell)),
      worker_("hub push", [this](const std::stop_token& stop) { Run(stop); }) {}

HubPusher::~HubPusher() {
  worker_.RequestStop();
}

void HubPusher::LibraryWasSaved() {
  {
    const std::scoped_lock lock(mutex_);
    is_due_ = true;
  }
  changed_.notify_all();
}

bool HubPusher::Finish(const std::function<void()>& takes_long) {
  {
    const std::scoped_lock lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (takes_long) {
    const auto end = std::chrono::steady_clock::now() + kLongWait;
    while (!worker_.finished() && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(kBetweenLooks);
    if (!worker_.finished()) takes_long();
  }
  worker_.Join();
  return is_complete_;
}

void HubPusher::Say(const std::string& sentence) {
  if (tell_) tell_(sentence);
}

bool HubPusher::PushOnce() {
  std::set<std::string> said;
  bool is_complete = false;
  try {
    const SyncReport report = Push(options_);
    said.insert(report.lines.begin(), report.lines.end());
    is_complete = report.problems == 0;
    for (const std::string& line : report.lines) {
      if (!told_.contains(line)) Say(line);
    }
  } catch (const std::exception& error) {
    // Also what is no Error, as a disk that fails: a session does not end because of its hub.
    said = {error.what()};
    if (!options_.is_stopped() && !told_.contains(error.what()))
      Say(std::string(error.what()) + "; changes are saved in the library and sent to the hub later");
  }
  told_ = std::move(said);
  return is_complete;
}

void HubPusher::Run(const std::stop_token& stop) {
  options_.is_stopped = [stop, asked = options_.is_stopped] {
    return stop.stop_requested() || (asked && asked());
  };
  std::chrono::milliseconds retry = kFirstRetry;
  while (!stop.stop_requested()) {
    bool is_last = false;
    {
      std::unique_lock lock(mutex_);
      const auto is_asked = [this] { return is_due_ || is_ending_; };
      if (is_complete_) {
        changed_.wait(lock, stop, is_asked);
      } else if (!is_due_) {
        changed_.wait_for(lock, stop, retry, is_asked);
      }
      is_last = is_ending_;
      if (is_last && is_complete_ && !is_due_) return;
      is_due_ = false;
    }
    if (options_.is_stopped()) {
      is_complete_ = false;
      if (is_last) return;
      continue;
    }
    is_complete_ = PushOnce();
    retry = is_complete_ ? kFirstRetry : std::min(2 * retry, kLongestRetry);
    if (is_last) return;
  }
}

}  // namespace docent::maps
