// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper_output.h"

#include <algorithm>

namespace docent::engine {

std::shared_ptr<const MapSnapshot> MapperOutput::Snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

std::vector<MapperEvent> MapperOutput::TakeEvents() {
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

MapperTimes MapperOutput::Times() const {
  const std::lock_guard lock(mutex_);
  return times_;
}

std::vector<EstimatedLens> MapperOutput::Lenses() const {
  const std::lock_guard lock(mutex_);
  return lenses_;
}

void MapperOutput::Publish(std::shared_ptr<const MapSnapshot> snapshot) {
  const std::lock_guard lock(mutex_);
  snapshot_.swap(snapshot);  // the last one is freed after the lock
}

void MapperOutput::SetLenses(std::vector<EstimatedLens> lenses) {
  const std::lock_guard lock(mutex_);
  lenses_ = std::move(lenses);
}

void MapperOutput::CountLoop() {
  const std::lock_guard lock(mutex_);
  ++times_.loops_closed;
}

void MapperOutput::AddTime(double MapperTimes::*account, double seconds, double queue_latency) {
  const std::lock_guard lock(mutex_);
  times_.max_queue_latency = std::max(times_.max_queue_latency, queue_latency);
  if (account != nullptr) times_.*account += seconds;
}

}  // namespace docent::engine
