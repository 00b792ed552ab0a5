// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>

#include "engine/base/time.h"

namespace docent::app {

// The clock for realtime playback and for the age of images: CLOCK_MONOTONIC, which devices use for their
// timestamps too. Tests substitute their own. Any thread.
class PlayClock {
 public:
  virtual ~PlayClock() = default;
  // The present time.
  virtual Timestamp Now();
  // Returns at `time`, or when stop is requested.
  virtual void WaitUntil(Timestamp time, const std::stop_token& stop);
  // Whether the time stands still.
  virtual bool IsStopped() const { return false; }
  // Whether what is waited for comes at once.
  virtual bool IsFastForward() const { return false; }
};

// A clock that a person can stop: then no time passes. During fast forward it jumps to each time that is
// waited for. Any thread.
class PausableClock : public PlayClock {
 public:
  explicit PausableClock(bool is_stopped = false);
  Timestamp Now() override;
  // Also returns when the clock is stopped or is stopped meanwhile.
  void WaitUntil(Timestamp time, const std::stop_token& stop) override;
  bool IsStopped() const override;
  void Stop();
  void Resume();
  bool IsFastForward() const override;
  void SetFastForward(bool is_fast_forward);

 private:
  Timestamp NowLocked() const;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  // How long it was stopped, without the present stop, less what it has jumped.
  Timestamp lost_{};
  bool is_fast_forward_ = false;
  std::optional<Timestamp> stopped_at_;  // Of the machine's clock.
};

// Plays images at their own times. Shared by the cameras of a session; any thread.
class RealtimeClock {
 public:
  explicit RealtimeClock(PlayClock* clock) : clock_(clock) {}
  // Defines the present as the time of this image. To be called before any other function.
  void Start(Timestamp time) { start_ = clock_->Now() - time; }
  // Waits until the image is due.
  void WaitFor(Timestamp time, const std::stop_token& stop) { clock_->WaitUntil(Due(time), stop); }
  // Whether the next image is due already.
  bool IsLate(Timestamp time, Timestamp period) { return clock_->Now() > Due(time) + period; }
  bool IsStopped() const { return clock_->IsStopped(); }
  bool IsFastForward() const { return clock_->IsFastForward(); }
  Timestamp Due(Timestamp time) const { return start_ + time; }
  Timestamp Now() { return clock_->Now(); }

 private:
  PlayClock* const clock_;
  Timestamp start_{};  // when an image of time 0 would have been due
};

}  // namespace docent::app
