// SPDX-License-Identifier: Apache-2.0
#include "app/session/untracked_images.h"

#include <utility>

namespace docent::app {

UntrackedImages::UntrackedImages(FrameSource* source, RealtimeClock* clock, int camera, Show show)
    : source_(source),
      clock_(clock),
      camera_(camera),
      show_(std::move(show)),
      is_live_(source->info().live),
      period_(FromSeconds(1 / source->info().nominal_fps)),
      worker_("untracked", [this](const std::stop_token& stop) { Run(stop); }) {}

void UntrackedImages::During(const std::function<void()>& work, std::chrono::nanoseconds after,
                             Timestamp last, Timestamp offset) {
  {
    const std::scoped_lock lock(mutex_);
    last_ = last;
    offset_ = offset;
    next_ = std::chrono::steady_clock::now() + after;
    done_ = std::stop_source();
    is_wanted_ = !has_ended_;
  }
  changed_.notify_all();
  std::exception_ptr fault;
  try {
    work();
  } catch (...) {
    fault = std::current_exception();
  }
  done_.request_stop();
  std::unique_lock lock(mutex_);
  is_wanted_ = false;
  changed_.notify_all();
  changed_.wait(lock, [this] { return !is_fetching_; });
  const std::exception_ptr source_fault = std::exchange(fault_, nullptr);
  if (!fault) fault = source_fault;
  if (fault) std::rethrow_exception(fault);
}

std::vector<engine::Frame> UntrackedImages::TakeFetched() {
  return std::exchange(fetched_, {});
}

void UntrackedImages::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (!changed_.wait(lock, stop, [this] { return is_wanted_; })) return;
    const auto due = next_;  // A copy, as it changes while this waits.
    changed_.wait_until(lock, stop, due, [this] { return !is_wanted_; });
    // The work may have been done and other work begun meanwhile.
    if (!is_wanted_ || std::chrono::steady_clock::now() < next_) continue;
    is_fetching_ = true;
    const std::stop_token done = done_.get_token();
    lock.unlock();
    bool goes_on = false;
    std::exception_ptr fault;
    try {
      goes_on = Fetch(done);
    } catch (...) {
      fault = std::current_exception();
    }
    lock.lock();
    is_fetching_ = false;
    is_wanted_ = is_wanted_ && goes_on;
    next_ = std::chrono::steady_clock::now() + kInterval;
    if (fault) fault_ = fault;
    changed_.notify_all();
  }
}

bool UntrackedImages::Fetch(const std::stop_token& done) {
  // What is played fast forward is not waited for.
  if (clock_->IsFastForward() || clock_->IsStopped()) return true;
  engine::Frame frame;
  while (!done.stop_requested()) {
    const std::optional<Timestamp> known = is_live_ ? std::nullopt : source_->NextTime();
    const Timestamp time = known ? *known - offset_ : last_ + period_;
    const bool late = !is_live_ && clock_->IsLate(time, period_);
    if (!is_live_ && !late) {
      clock_->WaitFor(time, done);
      if (done.stop_requested()) return false;
    }
    frame = engine::Frame();
    has_ended_ = !(late ? source_->NextLate(&frame) : source_->Next(&frame));
    if (has_ended_) return false;
    frame.camera = camera_;
    frame.time -= offset_;
    // A device that is away; the thread that tracks will say so.
    if (!late && frame.image.empty()) return false;
    Add(frame);
    if (late && (frame.image.empty() || clock_->IsLate(frame.time, period_))) continue;
    show_(frame);
    return true;
  }
  return false;
}

void UntrackedImages::Add(engine::Frame frame) {
  last_ = frame.time;
  frame.image = cv::Mat();
  fetched_.push_back(std::move(frame));
}

}  // namespace docent::app
