// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub_follower.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <thread>
#include <utility>

#include "maps/hub/hub.h"

namespace docent::maps {

namespace {

constexpr std::chrono::milliseconds kListenStep(200);  // Until a stop is noticed.
// A change is told at once; this is for those that were made while the connection was being set up again.
constexpr std::chrono::seconds kAskAnyway(20);
constexpr std::chrono::milliseconds kFirstDelay(500), kLongestDelay(30'000);  // Before the next attempt.
// The same for a map that could not be pulled, of which all images may have to be decoded again.
constexpr std::chrono::milliseconds kLongestDelayOfMaps(300'000);

// Returns early when a stop is requested.
void SleepUnlessStopped(std::chrono::milliseconds time, const std::stop_token& stop) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!stop.stop_requested() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(kListenStep / 4);
}

}  // namespace

HubFollower::HubFollower(SyncOptions options, Callbacks callbacks)
    : options_(std::move(options)),
      callbacks_(std::move(callbacks)),
      worker_("hub", [this](const std::stop_token& stop) { Follow(stop); }) {}

void HubFollower::Tell(const std::string& sentence) {
  if (sentence == told_) return;
  told_ = sentence;
  if (callbacks_.told) callbacks_.told(sentence);
}

SyncReport HubFollower::PullAndTell() {
  SyncReport report;
  try {
    Pull(options_, &report);
  } catch (...) {
    // What was pulled before the connection was lost is in the library, and the next pull finds it there.
    TellOf(report);
    lines_.insert(report.lines.begin(), report.lines.end());
    throw;
  }
  if (!is_connected_) Tell("connected to the hub; the library follows it");
  is_connected_ = true;
  TellOf(report);
  lines_ = {report.lines.begin(), report.lines.end()};
  return report;
}

void HubFollower::TellOf(const SyncReport& report) {
  for (const std::string& line : report.lines) {
    if (!lines_.contains(line) && callbacks_.told) callbacks_.told(line);
  }
  if (!report.changed_keys.empty() && callbacks_.pulled) callbacks_.pulled(report);
}

void HubFollower::FollowConnected(const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  Hub hub(options_.hub);
  hub.Listen();
  std::int64_t seen = -1;
  std::chrono::milliseconds delay = kFirstDelay;
  std::optional<Clock::time_point> retry;  // What could not be pulled is tried again then.
  while (!stop.stop_requested()) {
    // Before the pull, so that a change during it is not missed.
    const std::int64_t last = hub.LastChange();
    if (last != seen || (retry && Clock::now() >= *retry)) {
      if (last != seen) delay = kFirstDelay;
      seen = last;
      const SyncReport report = PullAndTell();
      retry.reset();
      if (report.problems > 0) {
        retry = Clock::now() + delay;
        // Whether an authoring session has ended is asked more often, because that costs little.
        delay = std::min<std::chrono::milliseconds>(2 * delay,
                                                    report.waiting > 0 ? kAskAnyway : kLongestDelayOfMaps);
      }
    }
    const auto next = std::min(Clock::now() + kAskAnyway, retry.value_or(Clock::time_point::max()));
    while (!stop.stop_requested() && !hub.WaitForChange(kListenStep) && Clock::now() < next) {
    }
  }
}

void HubFollower::Follow(const std::stop_token& stop) {
  options_.is_stopped = [stop] { return stop.stop_requested(); };
  std::chrono::milliseconds delay = kFirstDelay;
  while (!stop.stop_requested()) {
    is_connected_ = false;
    try {
      FollowConnected(stop);
    } catch (const std::exception& error) {
      // Also what is no Error, as a disk that fails: a tour does not end because of its hub.
      if (stop.stop_requested()) return;
      if (is_connected_) delay = kFirstDelay;
      Tell(std::string(error.what()) + "; the tour continues with the maps in the library");
    }
    SleepUnlessStopped(delay, stop);
    delay = std::min(2 * delay, kLongestDelay);
  }
}

}  // namespace docent::maps
