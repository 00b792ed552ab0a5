// SPDX-License-Identifier: Apache-2.0
#include "app/session/play_clock.h"

#include <algorithm>
#include <chrono>

namespace docent::app {

Timestamp PlayClock::Now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

void PlayClock::WaitUntil(Timestamp time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any woken;
  std::unique_lock lock(mutex);
  woken.wait_until(lock, stop, std::chrono::steady_clock::time_point(time), [] { return false; });
}

PausableClock::PausableClock(bool is_stopped) {
  if (is_stopped) Stop();
}

Timestamp PausableClock::NowLocked() const {
  return (stopped_at_ ? *stopped_at_ : std::chrono::steady_clock::now().time_since_epoch()) - lost_;
}

Timestamp PausableClock::Now() {
  const std::scoped_lock lock(mutex_);
  return NowLocked();
}

void PausableClock::WaitUntil(Timestamp time, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, std::chrono::steady_clock::time_point(time + lost_),
                      [this] { return stopped_at_.has_value() || is_fast_forward_; });
  if (is_fast_forward_ && !stopped_at_) lost_ -= std::max(Timestamp{}, time - NowLocked());
}

bool PausableClock::IsFastForward() const {
  const std::scoped_lock lock(mutex_);
  return is_fast_forward_;
}

void PausableClock::SetFastForward(bool is_fast_forward) {
  {
    const std::scoped_lock lock(mutex_);
    is_fast_forward_ = is_fast_forward;
  }
  changed_.notify_all();
}

bool PausableClock::IsStopped() const {
  const std::scoped_lock lock(mutex_);
  return stopped_at_.has_value();
}

void PausableClock::Stop() {
  {
    const std::scoped_lock lock(mutex_);
    if (!stopped_at_) stopped_at_ = std::chrono::steady_clock::now().time_since_epoch();
  }
  changed_.notify_all();
}

void PausableClock::Resume() {
  const std::scoped_lock lock(mutex_);
  if (stopped_at_) lost_ += std::chrono::steady_clock::now().time_since_epoch() - *stopped_at_;
  stopped_at_.reset();
}

}  // namespace docent::app
