// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper_queue.h"

#include <utility>

namespace docent::engine {

bool MapperQueue::Offer(Request request) {
  const std::lock_guard lock(mutex_);
  if (requests_.size() >= max_length_) return false;
  requests_.push_back(std::move(request));
  if (working_ && !offered_during_work_) offered_during_work_ = std::chrono::steady_clock::now();
  interrupt_ = true;
  return true;
}

void MapperQueue::Report(std::vector<PointReport> reports) {
  const std::lock_guard lock(mutex_);
  reports_.insert(reports_.end(), reports.begin(), reports.end());
}

std::vector<PointReport> MapperQueue::TakeReports() {
  const std::lock_guard lock(mutex_);
  return std::exchange(reports_, {});
}

std::size_t MapperQueue::Length() const {
  const std::lock_guard lock(mutex_);
  return requests_.size();
}

void MapperQueue::Clear() {
  const std::lock_guard lock(mutex_);
  requests_.clear();
  reports_.clear();
}

std::optional<MapperQueue::Request> MapperQueue::BeginStep() {
  const std::lock_guard lock(mutex_);
  std::optional<Request> request;
  if (!requests_.empty()) {
    request = std::move(requests_.front());
    requests_.pop_front();
  }
  interrupt_ = !requests_.empty();
  working_ = true;
  return request;
}

void MapperQueue::BeginOtherWork() {
  const std::lock_guard lock(mutex_);
  working_ = true;
}

double MapperQueue::EndWork() {
  const std::lock_guard lock(mutex_);
  working_ = false;
  const auto offered = std::exchange(offered_during_work_, std::nullopt);
  if (!offered) return 0;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - *offered).count();
}

}  // namespace docent::engine
