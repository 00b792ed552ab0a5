// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_comparer.h"

#include <utility>

#include "engine/base/thread_priority.h"

namespace docent::engine {

MapComparer::MapComparer(const MapOverlapOptions& options, std::function<void()> on_done)
    : options_(options), on_done_(std::move(on_done)) {}

MapComparer::~MapComparer() {
  Cancel();
}

void MapComparer::Start(std::uint64_t number, std::shared_ptr<const MapSnapshot> a,
                        std::shared_ptr<const MapSnapshot> b) {
  Replace(Request{number, std::move(a), std::move(b)});
  changed_.notify_all();
}

void MapComparer::Cancel() {
  Replace(std::nullopt);
}

void MapComparer::Replace(std::optional<Request> request) {
  // Freeing a large snapshot takes a while, and is done without the lock.
  std::optional<Result> dropped;
  const std::scoped_lock lock(mutex_);
  request_.swap(request);
  result_.swap(dropped);
  error_ = nullptr;
  interrupt_ = true;
  // Most sessions compare no maps.
  if (!request_ || worker_) return;
  worker_.emplace("map comparer", [this](const std::stop_token& stop) {
    LowerThreadPriority();
    Run(stop);
  });
}

std::optional<MapComparer::Result> MapComparer::Take() {
  const std::scoped_lock lock(mutex_);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  return std::exchange(result_, std::nullopt);
}

void MapComparer::Run(const std::stop_token& stop) {
  while (true) {
    Request request;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return request_.has_value(); })) return;
      request = *std::exchange(request_, std::nullopt);
      interrupt_ = false;
    }
    Result result{request.number, {}};
    std::exception_ptr error;
    try {
      result.comparison =
          CompareForJoining(options_, std::move(request.a), std::move(request.b), &interrupt_);
    } catch (...) {
      error = std::current_exception();
    }
    {
      const std::scoped_lock lock(mutex_);
      if (interrupt_) continue;
      if (!error) result_ = std::move(result);
      error_ = error;
    }
    on_done_();
  }
}

}  // namespace docent::engine
