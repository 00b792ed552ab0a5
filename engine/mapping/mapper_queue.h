// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

#include "engine/initialization/corner_sequence.h"
#include "engine/mapping/keyframe_candidate.h"

namespace docent::engine {

// What the trackers hand to the mapper: keyframes, first views of a map, and reports on points. It also
// measures how long the mapper's work delays what is offered meanwhile. All functions may be called from any
// thread, but work begins and ends on the thread that runs the mapper.
class MapperQueue {
 public:
  // A keyframe to be inserted, two views that start a map, or corners that determine the readout time of a
  // camera.
  using Request = std::variant<KeyFrameCandidate, InitialPair, TrackedCorners>;

  // max_length: requests that wait at most.
  explicit MapperQueue(std::size_t max_length) : max_length_(max_length) {}

  // False if the queue is full. An adjustment in progress is interrupted.
  bool Offer(Request request);
  void Report(std::vector<PointReport> reports);
  // All reports since the last call.
  std::vector<PointReport> TakeReports();
  std::size_t Length() const;
  // Drops all requests and reports.
  void Clear();
  // Interrupts an adjustment in progress, whose result is not needed any more.
  void Interrupt() { interrupt_ = true; }

  // The next request if one waits. Work lasts until EndWork.
  std::optional<Request> BeginStep();
  // For work that is no step: takes no request.
  void BeginOtherWork();
  // Returns the seconds by which the work delayed a request that was offered meanwhile; 0 if none was.
  double EndWork();

  // True while a request waits, and from Interrupt to the next BeginStep.
  const std::atomic<bool>* interrupt() const { return &interrupt_; }

 private:
  const std::size_t max_length_;
  std::atomic<bool> interrupt_{false};
  mutable std::mutex mutex_;  // guards the members below; held only while small lists are copied
  std::deque<Request> requests_;
  std::vector<PointReport> reports_;
  std::optional<std::chrono::steady_clock::time_point> offered_during_work_;
  bool working_ = false;
};

}  // namespace docent::engine
