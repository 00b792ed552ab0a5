// SPDX-License-Identifier: Apache-2.0
#include "app/session/frame_loop.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/worker.h"

namespace docent::app {

namespace {

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
  Timestamp Due(Timestamp time) const { return start_ + time; }
  Timestamp Now() { return clock_->Now(); }

 private:
  PlayClock* const clock_;
  Timestamp start_{};  // when an image of time 0 would have been due
};

// Synchronizes cameras that are processed as fast as possible: none proceeds to an image that is later, by
// more than the slack, than one that another camera has not finished. Any thread.
class ImageGate {
 public:
  ImageGate(std::size_t cameras, Timestamp slack) : times_(cameras, Timestamp::min()), slack_(slack) {}

  void Wait(std::size_t camera, Timestamp time, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    times_[camera] = time;
    changed_.notify_all();
    changed_.wait(lock, stop,
                  [&] { return time <= *std::min_element(times_.begin(), times_.end()) + slack_; });
  }
  // The camera has no more images, or none for now.
  void Leave(std::size_t camera) {
    const std::scoped_lock lock(mutex_);
    times_[camera] = Timestamp::max() - slack_;
    changed_.notify_all();
  }

 private:
  std::vector<Timestamp> times_;  // of the image that each camera is at
  const Timestamp slack_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
};

// Executes the commands that are due, from the script and from the inbox, and reports them.
class CommandRunner {
 public:
  CommandRunner(const FrameLoopOptions& options, Session* session)
      : options_(options), session_(session), next_(options.script.begin()) {}

  // now: time since the first image.
  void RunDue(Timestamp now, const engine::TrackedFrame& frame) {
    for (; next_ != options_.script.end() && next_->time <= now; ++next_) {
      try {
        Run(next_->command, now, frame);
      } catch (const Error& error) {
        const std::string sentence = error.what();
        throw Error(Line(*next_) + sentence + (sentence.ends_with('.') ? "" : "."));
      }
    }
    if (options_.inbox == nullptr) return;
    for (const CommandInbox::Entry& entry : options_.inbox->TakeAll()) {
      try {
        const engine::TrackedFrame& seen = entry.frame ? *entry.frame : frame;
        // Recorded with the time of the frame that the user saw, so that its pixel keeps its meaning on
        // replay.
        Run(entry.command, now - (frame.frame.time - seen.frame.time), seen);
      } catch (const Error& error) {
        if (options_.refused) options_.refused(error.what());
      }
    }
  }

  // Throws when the images ended before the last command of the script.
  void CheckAllDone() const {
    if (next_ == options_.script.end()) return;
    throw Error(Line(*next_) + "the images ended before the time of this command.");
  }

 private:
  std::string Line(const TimedCommand& command) const {
    return options_.script_name + ", line " + std::to_string(command.line) + ": ";
  }
  void Run(const Command& command, Timestamp time, const engine::TrackedFrame& frame) {
    if (!options_.take || !options_.take(command, frame))
      session_->Execute(command, frame, options_.model_folder);
    last_time_ = std::max(last_time_, time);
    if (options_.carried_out) options_.carried_out({last_time_, 0, command});
  }

  const FrameLoopOptions& options_;
  Session* const session_;
  std::vector<TimedCommand>::const_iterator next_;
  Timestamp last_time_{};  // the times of a recorded script must not decrease
};

// Reports the images that a source lost before this one, from the gap in the indices. While a device is away
// its index does not advance, so no frames are invented for that time.
class GapReporter {
 public:
  void Report(const engine::Frame& frame, const std::function<void(const engine::TrackedFrame&)>& shown) {
    const auto last = std::exchange(last_, std::pair(frame.index, frame.time));
    if (!last || frame.index <= last->first + 1) return;
    const std::uint64_t steps = frame.index - last->first;
    for (std::uint64_t i = 1; i < steps; ++i) {
      engine::TrackedFrame dropped;
      dropped.frame.camera = frame.camera;
      dropped.frame.index = last->first + i;
      dropped.frame.time = last->second + (frame.time - last->second) * static_cast<std::int64_t>(i) /
                                              static_cast<std::int64_t>(steps);
      dropped.state = engine::TrackingState::kDropped;
      shown(dropped);
    }
  }

 private:
  std::optional<std::pair<std::uint64_t, Timestamp>> last_;
};

void PreloadModels(const FrameLoopOptions& options, Session* session) {
  for (const TimedCommand& command : options.script) {
    try {
      session->Preload(command.command, options.model_folder);
    } catch (const Error& error) {
      throw Error(options.script_name + ", line " + std::to_string(command.line) + ": " + error.what());
    }
  }
}

// One camera of a session, processed image by image.
class CameraFeed {
 public:
  CameraFeed(const CameraRun& run, Session* session, RealtimeClock* clock)
      : run_(run),
        session_(session),
        clock_(clock),
        live_(run.camera->source->info().live),
        period_(FromSeconds(1 / run.camera->source->info().nominal_fps)),
        command_runner_(run.options, session) {}

  // Gets the next image; false at the end of the source or when stop is requested.
  bool Fetch(const std::stop_token& stop) {
    FrameSource& source = *run_.camera->source;
    while (!stop.stop_requested()) {
      late_ = WillBeLate();
      frame_ = engine::Frame();
      if (!(late_ ? source.NextLate(&frame_) : source.Next(&frame_))) return false;
      frame_.camera = run_.options.camera;
      frame_.time -= clock_offset_;
      if (late_) {
        // In a recording with gaps, the image after a gap may not be late.
        late_ = frame_.image.empty() || clock_->IsLate(frame_.time, period_);
        return true;
      }
      if (std::string now = source.trouble(); now != trouble_) {
        trouble_ = std::move(now);
        if (run_.options.trouble) run_.options.trouble(trouble_, frame_.time);
      }
      if (frame_.image.empty()) continue;
      if (live_) gaps_.Report(frame_, run_.shown);
      if (!first_time_) {
        first_time_ = frame_.time;
        run_.camera->CheckImage(frame_.image);
      }
      return true;
    }
    return false;
  }
  Timestamp time() const { return frame_.time; }
  Timestamp period() const { return period_; }
  bool live() const { return live_; }

  // To be called between the first Fetch and the first Handle, with the lead of this source's clock.
  void SetClockOffset(Timestamp offset) {
    clock_offset_ = offset;
    frame_.time -= offset;
    *first_time_ -= offset;
  }

  // Processes the image of the last Fetch.
  void Handle(const std::stop_token& stop) {
    const Pace pace = run_.options.pace;
    engine::TrackedFrame tracked;
    // Only recordings are paced: a device drops images that are not fetched in time.
    if (late_) {
      tracked.frame = frame_;
      tracked.state = engine::TrackingState::kDropped;
      run_.shown(tracked);
      return;
    }
    if (pace == Pace::kRealtime && !live_) clock_->WaitFor(frame_.time, stop);
    if (pace == Pace::kEager) WaitForMapper(stop);
    SetHeadRotation();
    tracked = session_->Process(frame_);
    ReportLatency();
    command_runner_.RunDue(frame_.time - *first_time_, tracked);
    run_.shown(tracked);
    if (run_.options.idle) last_tracked_ = std::move(tracked);
  }

  // Goes on with the last image while the clock is stopped.
  void Pause(const std::stop_token& stop) {
    const auto begin = std::chrono::steady_clock::now();
    while (run_.options.idle && clock_->IsStopped() && !stop.stop_requested()) {
      CarryOut(std::chrono::steady_clock::now() - begin, false);
      Rest(stop);
    }
  }

  // Carries out what the person wants while there is no other image, `passed` after the last one.
  void CarryOut(Timestamp passed, bool at_end) {
    if (!run_.options.idle || !last_tracked_) return;
    command_runner_.RunDue(last_tracked_->frame.time - *first_time_, *last_tracked_);
    session_->Idle(last_tracked_->frame.time + passed);
    run_.options.idle(*last_tracked_, at_end);
  }

  // The time between two calls of CarryOut.
  static void Rest(const std::stop_token& stop) {
    constexpr auto kInterval = std::chrono::milliseconds(33);
    PlayClock machine;
    machine.WaitUntil(machine.Now() + kInterval, stop);
  }

  void CheckAllDone() const { command_runner_.CheckAllDone(); }

 private:
  // A file delivers faster than a camera, and would run ahead of the mapper, which with a real camera has the
  // whole time between images. The source waits therefore, never the tracker.
  void WaitForMapper(const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    if (last_processed_) due = last_processed_->first + (frame_.time - last_processed_->second);
    session_->WaitUntilIdle(due, stop);
    last_processed_ = {std::chrono::steady_clock::now(), frame_.time};
  }

  // Tells the tracker how far the head was commanded to rotate since the last tracked image.
  void SetHeadRotation() {
    Head* const head = run_.camera->source->head();
    if (head == nullptr) return;
    const engine::Rotation3 now = CarrierFromCamera(head->At(frame_.time));
    constexpr double kStill_rad = 1e-4;
    if (last_head_rotation_) {
      const engine::Rotation3 turn = now.inverse() * *last_head_rotation_;
      if (turn.Angle() > kStill_rad) frame_.commanded_rotation = turn;
    }
    last_head_rotation_ = now;
  }

  // Decided before an image is fetched: an image that is slow to produce (a simulation on a busy machine) is
  // tracked although it is old, but images that would be late even if they were available at once are
  // skipped.
  bool WillBeLate() {
    return run_.options.pace == Pace::kRealtime && !live_ && first_time_ &&
           clock_->IsLate(frame_.time + period_, period_);
  }

  void ReportLatency() {
    if (!run_.options.latency) return;
    if (live_) {
      run_.options.latency(clock_->Now() - (frame_.time + clock_offset_));
    } else if (run_.options.pace == Pace::kRealtime) {
      run_.options.latency(clock_->Now() - clock_->Due(frame_.time));
    }
  }

  const CameraRun& run_;
  Session* const session_;
  RealtimeClock* const clock_;
  std::optional<engine::Rotation3>
      last_head_rotation_;  // carrier_from_camera of the head at the last tracked image
  const bool live_;
  const Timestamp period_;
  CommandRunner command_runner_;
  GapReporter gaps_;
  engine::Frame frame_;
  bool late_ = false;  // the image is to be dropped
  std::optional<Timestamp> first_time_;
  Timestamp clock_offset_{};
  // Eager pace: when the previous image was processed, and its own time.
  std::optional<std::pair<std::chrono::steady_clock::time_point, Timestamp>> last_processed_;
  std::optional<engine::TrackedFrame> last_tracked_;  // only with FrameLoopOptions::idle
  std::string trouble_;
};

// Runs all cameras on this thread, always the one with the oldest image next; the first one of equally old
// ones.
void RunInterleaved(std::vector<CameraFeed>* feeds, const std::stop_token& stop) {
  std::vector<CameraFeed*> running;
  for (CameraFeed& feed : *feeds) running.push_back(&feed);
  while (!stop.stop_requested()) {
    const auto oldest = std::min_element(running.begin(), running.end(),
                                         [](const auto* a, const auto* b) { return a->time() < b->time(); });
    (*oldest)->Handle(stop);
    (*oldest)->Pause(stop);
    if ((*oldest)->Fetch(stop)) continue;
    if (*oldest == &feeds->front()) return;
    running.erase(oldest);
  }
}

void RunConcurrently(std::vector<CameraFeed>* feeds, Pace pace, std::stop_source* stopping) {
  const std::stop_token stop = stopping->get_token();
  ImageGate gate(feeds->size(), feeds->front().period());
  for (std::size_t i = 0; i < feeds->size(); ++i) {
    if ((*feeds)[i].live()) gate.Leave(i);  // devices need no synchronization
  }
  const auto run = [&](std::size_t i) {
    CameraFeed& feed = (*feeds)[i];
    try {
      do {
        if (pace == Pace::kEager && !feed.live()) gate.Wait(i, feed.time(), stop);
        feed.Handle(stop);
        feed.Pause(stop);
      } while (!stop.stop_requested() && feed.Fetch(stop));
      gate.Leave(i);
    } catch (...) {
      gate.Leave(i);
      stopping->request_stop();
      throw;
    }
  };
  std::vector<std::unique_ptr<Worker>> others;
  for (std::size_t i = 1; i < feeds->size(); ++i) {
    others.push_back(std::make_unique<Worker>("camera " + std::to_string(i),
                                              [&run, i](const std::stop_token&) { run(i); }));
  }
  std::exception_ptr fault;
  try {
    run(0);
  } catch (...) {
    fault = std::current_exception();
  }
  stopping->request_stop();
  for (const auto& other : others) {
    try {
      other->Join();
    } catch (...) {
      if (!fault) fault = std::current_exception();
    }
  }
  if (fault) std::rethrow_exception(fault);
}

// After the last images, the person goes on working with them.
void StayAtEnd(std::vector<CameraFeed>* feeds, const std::stop_token& stop) {
  const auto begin = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    for (CameraFeed& feed : *feeds) feed.CarryOut(std::chrono::steady_clock::now() - begin, true);
    CameraFeed::Rest(stop);
  }
}

}  // namespace

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
                      [this] { return stopped_at_.has_value(); });
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

void RunCameras(const std::vector<CameraRun>& cameras, Session* session, const std::stop_token& stop) {
  constexpr Timestamp kSameClock = std::chrono::seconds(10);
  for (const CameraRun& run : cameras) PreloadModels(run.options, session);
  std::stop_source stopping;
  const std::stop_callback forward(stop, [&stopping] { stopping.request_stop(); });
  PlayClock machine;
  RealtimeClock clock(cameras.front().options.clock ? cameras.front().options.clock : &machine);
  std::vector<CameraFeed> feeds;
  feeds.reserve(cameras.size());
  for (const CameraRun& run : cameras) {
    CameraFeed& feed = feeds.emplace_back(run, session, &clock);
    if (!feed.Fetch(stop)) {
      if (!stop.stop_requested()) feed.CheckAllDone();
      return;
    }
    const Timestamp ahead = feed.time() - feeds.front().time();
    if (ahead > kSameClock || ahead < -kSameClock) feed.SetClockOffset(ahead);
  }
  // Only after all first images are there; otherwise cameras that waited for the others would start late.
  clock.Start(feeds.front().time());
  const Pace pace = cameras.front().options.pace;
  if (pace == Pace::kLockstep) {
    RunInterleaved(&feeds, stopping.get_token());
  } else {
    RunConcurrently(&feeds, pace, &stopping);
  }
  if (stop.stop_requested()) return;
  for (const CameraFeed& feed : feeds) feed.CheckAllDone();
  if (cameras.front().options.stays) StayAtEnd(&feeds, stop);
}

void RunFrames(CalibratedCamera* camera, Session* session, const FrameLoopOptions& options,
               const FrameCallback& shown, const std::stop_token& stop) {
  RunCameras({{camera, options, shown}}, session, stop);
}

}  // namespace docent::app
