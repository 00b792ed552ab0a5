// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "engine/base/worker.h"
#include "engine/mapping/loops/map_joining.h"

namespace docent::engine {

// Compares two maps on a thread of its own, because a comparison takes seconds, in which the mapper has
// keyframes to insert. One comparison at a time. All functions may be called from any thread, and none waits
// for a comparison except the destructor, which interrupts it.
class MapComparer {
 public:
  // on_done: called on the comparing thread once Take has a result. No lock is held.
  MapComparer(const MapOverlapOptions& options, std::function<void()> on_done);
  ~MapComparer();
  MapComparer(const MapComparer&) = delete;
  MapComparer& operator=(const MapComparer&) = delete;

  // Compares these maps, and drops an earlier comparison.
  void Start(std::uint64_t number, std::shared_ptr<const MapSnapshot> a,
             std::shared_ptr<const MapSnapshot> b);
  // Drops the comparison: Take has no result of it.
  void Cancel();
  struct Result {
    std::uint64_t number = 0;  // that Start was given
    MapComparison comparison;
  };
  // The result of the last comparison, once; empty if there is none yet. Rethrows an exception that ended it.
  std::optional<Result> Take();

 private:
  struct Request {
    std::uint64_t number = 0;
    std::shared_ptr<const MapSnapshot> a, b;
  };

  // Drops the comparison for another one, or for none.
  void Replace(std::optional<Request> request);
  void Run(const std::stop_token& stop);

  const MapOverlapOptions options_;
  const std::function<void()> on_done_;
  std::atomic<bool> interrupt_{false};  // changed with mutex_ held; read without it by the comparison
  std::mutex mutex_;                    // guards the members below; never held during a comparison
  std::condition_variable_any changed_;
  std::optional<Request> request_;
  std::optional<Result> result_;
  std::exception_ptr error_;      // instead of a result
  std::optional<Worker> worker_;  // from the first Start on; last: it uses the other members
};

}  // namespace docent::engine
