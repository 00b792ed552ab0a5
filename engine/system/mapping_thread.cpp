// SPDX-License-Identifier: Apache-2.0
#include "engine/system/mapping_thread.h"

#include <chrono>
#include <memory>
#include <utility>
#include <variant>

#include "engine/base/thread_priority.h"

namespace docent::engine {

MappingThread::MappingThread(const MapperOptions& options, bool threaded, UpdateCallback on_update)
    : mapper_(options), on_update_(std::move(on_update)), comparer_(options.joining.overlap, [this] {
        {
          const std::scoped_lock lock(mutex_);
          compared_ = has_work_ = true;
        }
        changed_.notify_all();
      }) {
  if (!threaded) return;
  worker_.emplace("mapper", [this](const std::stop_token& stop) {
    LowerThreadPriority();
    try {
      Run(stop);
    } catch (...) {
      {
        const std::scoped_lock lock(mutex_);
        failed_ = true;
      }
      changed_.notify_all();
      ReportFailure();
      throw;
    }
  });
}

// Inside a catch block: tells the owner at once what ended the thread, which only Finish would say otherwise.
void MappingThread::ReportFailure() {
  MapperUpdate update;
  update.key = key_;
  update.adoption = adoption_number_;
  try {
    throw;
  } catch (const std::exception& error) {
    update.failure = error.what();
  } catch (...) {
    update.failure = "an unknown exception";
  }
  on_update_(update);
}

std::uint64_t MappingThread::Adopt(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot) {
  std::uint64_t number = 0;
  {
    const std::scoped_lock lock(mutex_);
    requested_key_ = key;
    number = ++adoptions_;
    adoption_ = Adoption{number, key, std::move(snapshot)};
    pair_.reset();
    join_.reset();
    interrupt_join_ = true;
    comparer_.Cancel();
    comparing_ = compared_ = false;
    starting_ = false;
    has_work_ = true;
    mapper_.Interrupt();
  }
  changed_.notify_all();
  if (!worker_) ApplyAdoption();
  return number;
}

bool MappingThread::Start(std::uint64_t key, InitialPair pair) {
  {
    const std::scoped_lock lock(mutex_);
    if (key != requested_key_ || starting_) return false;
    pair_ = std::move(pair);
    starting_ = has_work_ = true;
  }
  changed_.notify_all();
  return true;
}

bool MappingThread::IsStarting(std::uint64_t key) const {
  const std::scoped_lock lock(mutex_);
  return starting_ && requested_key_ == key;
}

void MappingThread::Join(std::uint64_t key, std::uint64_t number, std::shared_ptr<const MapSnapshot> other) {
  {
    const std::scoped_lock lock(mutex_);
    if (key != requested_key_) return;
    join_ = JoinRequest{number, std::move(other)};
    has_work_ = true;
  }
  changed_.notify_all();
}

bool MappingThread::Offer(std::uint64_t key, KeyFrameCandidate candidate, std::vector<PointReport> reports) {
  {
    const std::scoped_lock lock(mutex_);
    // Before the adoption is applied, a keyframe would be dropped by it or, worse, be added to the previous
    // map.
    if (key != requested_key_ || adoption_) return false;
    // Nothing takes the reports any more.
    if (failed_) return false;
    mapper_.Report(std::move(reports));
    if (!mapper_.Offer(std::move(candidate))) return false;
    has_work_ = true;
  }
  changed_.notify_all();
  return true;
}

void MappingThread::EstimateReadout(std::uint64_t key, TrackedCorners corners) {
  {
    const std::scoped_lock lock(mutex_);
    if (key != requested_key_ || adoption_ || !mapper_.Offer(std::move(corners))) return;
    has_work_ = true;
  }
  changed_.notify_all();
}

void MappingThread::ApplyAdoption() {
  std::unique_lock lock(mutex_);
  while (adoption_) {
    // Copying a large map takes a while; adoption_ stays set meanwhile, so that no keyframe is offered.
    const Adoption adoption = *adoption_;
    lock.unlock();
    if (mapper_.HasLoopToAdjust()) loops_to_adjust_.insert(key_);
    mapper_.Adopt(adoption.snapshot);
    if (loops_to_adjust_.erase(adoption.key) > 0) mapper_.RequireAdjustmentOfLoop();
    mapper_.TakeEvents();  // discards events of the previous map
    key_ = adoption.key;
    adoption_number_ = adoption.number;
    last_snapshot_ = adoption.snapshot;
    lock.lock();
    if (adoption_->number == adoption.number) adoption_.reset();
  }
  if (!pair_) return;
  if (mapper_.Start(*pair_)) {
    pair_.reset();
  } else {
    has_work_ = true;  // the queue is full: again after the next step
  }
}

void MappingThread::JoinIfRequested() {
  std::optional<JoinRequest> request;
  {
    const std::scoped_lock lock(mutex_);
    if (adoption_ || !join_) return;
    request = std::exchange(join_, std::nullopt);
    interrupt_join_ = false;
  }
  ReportJoin(request->number, mapper_.Join(*request->other, &interrupt_join_));
}

void MappingThread::CompareIfRequested() {
  const std::scoped_lock lock(mutex_);
  if (adoption_ || !join_) return;
  Compare(join_->number, std::move(join_->other));
  join_.reset();
  compared_again_ = false;
}

void MappingThread::Compare(std::uint64_t number, std::shared_ptr<const MapSnapshot> other) {
  comparer_.Start(number, mapper_.Snapshot(), std::move(other));
  comparing_ = true;
  compared_ = false;
}

void MappingThread::JoinIfCompared() {
  std::optional<MapComparer::Result> result;
  bool applies = true;
  {
    const std::scoped_lock lock(mutex_);
    if (adoption_ || !compared_ || !mapper_.MayJoin()) return;
    compared_ = false;
    // Empty if a comparison was dropped just when it was done.
    result = comparer_.Take();
    if (!result) return;
    comparing_ = false;
    applies = mapper_.StillApplies(result->comparison);
    if (!applies && !std::exchange(compared_again_, true)) {
      Compare(result->number, std::move(result->comparison.b));
      return;
    }
    interrupt_join_ = false;
  }
  // A map that is corrected again and again must not wait for ever.
  ReportJoin(result->number, applies ? mapper_.Join(result->comparison, &interrupt_join_)
                                     : mapper_.Join(*result->comparison.b, &interrupt_join_));
}

void MappingThread::ReportJoin(std::uint64_t number, MapJoinAttempt attempt) {
  MapperUpdate update;
  update.key = key_;
  update.adoption = adoption_number_;
  update.join = MapperUpdate::Join{number, std::move(attempt)};
  if (update.join->attempt.joined) update.snapshot = last_snapshot_ = mapper_.Snapshot();
  on_update_(update);
}

bool MappingThread::StepOnce() {
  const bool worked = mapper_.Step();
  MapperUpdate update;
  update.key = key_;
  update.adoption = adoption_number_;
  update.events = mapper_.TakeEvents();
  for (const MapperEvent& event : update.events) {
    if (std::holds_alternative<MapperEvent::LensesEstimated>(event.what)) update.lenses = mapper_.Lenses();
  }
  if (auto snapshot = mapper_.Snapshot(); snapshot != last_snapshot_)
    update.snapshot = last_snapshot_ = std::move(snapshot);
  if (update.snapshot || !update.events.empty()) {
    on_update_(update);
    for (const MapperEvent& event : update.events) {
      if (!std::holds_alternative<MapperEvent::MapStarted>(event.what) &&
          !std::holds_alternative<MapperEvent::StartFailed>(event.what))
        continue;
      const std::scoped_lock lock(mutex_);
      if (requested_key_ == key_) starting_ = false;
    }
  }
  return worked;
}

void MappingThread::RunLockstep() {
  ApplyAdoption();
  JoinIfRequested();
  for (int step = 0; step < kMaxSteps && !mapper_.IsIdle(); ++step) StepOnce();
  StepOnce();
}

void MappingThread::Run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(mutex_);
      idle_ = true;
      changed_.notify_all();
      if (!changed_.wait(lock, stop, [this] { return has_work_; })) return;
      idle_ = has_work_ = false;
    }
    ApplyAdoption();
    CompareIfRequested();
    bool more = true;
    while (more && !stop.stop_requested()) {
      JoinIfCompared();
      more = StepOnce();
      {
        const std::scoped_lock lock(mutex_);
        // has_work_ is set as well, so the outer loop continues with them.
        if (adoption_ || pair_ || join_) more = false;
      }
      changed_.notify_all();
    }
  }
}

bool MappingThread::IsBehind() const {
  return adoption_.has_value() || starting_ || mapper_.QueueLength() > 1;
}

bool MappingThread::IsIdle() const {
  const std::scoped_lock lock(mutex_);
  return HasNothingToDo();
}

void MappingThread::WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop) {
  if (!worker_) return;
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, latest, [this] { return failed_ || HasNothingToDo(); });
  changed_.wait(lock, stop, [this] { return failed_ || !IsBehind(); });
}

void MappingThread::Finish() {
  // In lockstep the number of steps is limited, not the time, so that two runs give the same map.
  constexpr int kMaxLastSteps = 500;
  constexpr auto kLongest = std::chrono::seconds(2);
  const bool threaded = worker_.has_value();
  {
    const std::scoped_lock lock(mutex_);
    join_.reset();
    interrupt_join_ = true;
  }
  if (threaded) {
    worker_->RequestStop();
    worker_->Join();
  }
  // The mapper's last steps may have led to a comparison.
  comparer_.Cancel();
  const auto start = std::chrono::steady_clock::now();
  for (int step = 0; step < kMaxLastSteps && StepOnce(); ++step) {
    if (threaded && std::chrono::steady_clock::now() - start > kLongest) return;
  }
}

}  // namespace docent::engine
