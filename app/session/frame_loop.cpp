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

// Plays images by their own times. Shared by the cameras of a session; any thread.
class RealtimeClock {
 public:
  explicit RealtimeClock(PlayClock* clock) : clock_(clock) {}
  // The present is the time of this image. Before any other call.
  void Start(Timestamp time) { start_ = clock_->Now() - time; }
  // Waits until the image is due.
  void WaitFor(Timestamp time, const std::stop_token& stop) { clock_->WaitUntil(Due(time), stop); }
  // Whether the image's successor is due already.
  bool IsLate(Timestamp time, Timestamp period) { return clock_->Now() > Due(time) + period; }
  Timestamp Due(Timestamp time) const { return start_ + time; }
  Timestamp Now() { return clock_->Now(); }

 private:
  PlayClock* const clock_;
  Timestamp start_{};  // when an image of time 0 would have been due
};

// Holds cameras together that are fed as fast as they are tracked: none goes on to an image that lies more
// than the slack after one that another camera has not finished. Any thread.
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
  // This camera has no more images, or none for now.
  void Leave(std::size_t camera) {
    const std::scoped_lock lock(mutex_);
    times_[camera] = Timestamp::max() - slack_;
    changed_.notify_all();
  }

 private:
  std::vector<Timestamp> times_;  // of the image that each is at
  const Timestamp slack_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
};

// Carries out what is due, from the script and from the inbox, and tells of it.
class Commander {
 public:
  Commander(const FrameLoopOptions& options, Session* session)
      : options_(options), session_(session), next_(options.script.begin()) {}

  // now: from the first image.
  void CarryOutDue(Timestamp now, const engine::TrackedFrame& frame) {
    for (; next_ != options_.script.end() && next_->time <= now; ++next_) {
      try {
        CarryOut(next_->command, now, frame);
      } catch (const Error& error) {
        throw Error(Line(*next_) + error.what() + ".");
      }
    }
    if (options_.inbox == nullptr) return;
    for (const CommandInbox::Entry& entry : options_.inbox->TakeAll()) {
      try {
        const engine::TrackedFrame& seen = entry.frame ? *entry.frame : frame;
        // A recorded script gives it at the frame that the person saw, so that its pixel means the same.
        CarryOut(entry.command, now - (frame.frame.time - seen.frame.time), seen);
      } catch (const Error& error) {
        if (options_.refused) options_.refused(error.what());
      }
    }
  }

  // Nothing of the script may be left when the images have ended.
  void CheckAllDone() const {
    if (next_ == options_.script.end()) return;
    throw Error(Line(*next_) + "the images ended before the time of this command.");
  }

 private:
  std::string Line(const TimedCommand& command) const {
    return options_.script_name + ", line " + std::to_string(command.line) + ": ";
  }
  void CarryOut(const Command& command, Timestamp time, const engine::TrackedFrame& frame) {
    session_->Execute(command, frame, options_.model_folder);
    last_time_ = std::max(last_time_, time);
    if (options_.carried_out) options_.carried_out({last_time_, 0, command});
  }

  const FrameLoopOptions& options_;
  Session* const session_;
  std::vector<TimedCommand>::const_iterator next_;
  Timestamp last_time_{};  // scripts never go back in time
};

// Hands on what a source lost before this image, as its index tells. After an absence the index goes on
// where it was, so that nothing is made up for the time in between.
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

// One camera's way through a session, an image at a time.
class CameraFeed {
 public:
  CameraFeed(const CameraRun& run, Session* session, RealtimeClock* clock)
      : run_(run),
        session_(session),
        clock_(clock),
        live_(run.camera->source->info().live),
        period_(FromSeconds(1 / run.camera->source->info().nominal_fps)),
        commander_(run.options, session) {}

  // Goes on to the next image; false at the end of the source or when stop is requested.
  bool Fetch(const std::stop_token& stop) {
    FrameSource& source = *run_.camera->source;
    while (!stop.stop_requested()) {
      late_ = MustBeLate();
      frame_ = engine::Frame();
      if (!(late_ ? source.NextLate(&frame_) : source.Next(&frame_))) return false;
      frame_.camera = run_.options.camera;
      frame_.time -= clock_offset_;
      if (late_) {
        // Recordings with gaps: what comes after one may be early.
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

  // Between the first Fetch and the first Handle: this source's clock is ahead by so much.
  void SetClockOffset(Timestamp offset) {
    clock_offset_ = offset;
    frame_.time -= offset;
    *first_time_ -= offset;
  }

  // The image that was fetched.
  void Handle(const std::stop_token& stop) {
    const Pace pace = run_.options.pace;
    engine::TrackedFrame tracked;
    // A device keeps time itself, and drops what nobody fetches.
    if (late_) {
      tracked.frame = frame_;
      tracked.state = engine::TrackingState::kDropped;
      run_.shown(tracked);
      return;
    }
    if (pace == Pace::kRealtime && !live_) clock_->WaitFor(frame_.time, stop);
    if (pace == Pace::kEager) WaitForMapper(stop);
    FollowHead();
    tracked = session_->Process(frame_);
    TellLatency();
    commander_.CarryOutDue(frame_.time - *first_time_, tracked);
    run_.shown(tracked);
  }

  void CheckAllDone() const { commander_.CheckAllDone(); }

 private:
  // A file delivers faster than a camera and would run away from the mapper, which in the world has the whole
  // time between images; so whoever feeds waits, never the tracker.
  void WaitForMapper(const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    if (handed_on_) due = handed_on_->first + (frame_.time - handed_on_->second);
    session_->WaitUntilIdle(due, stop);
    handed_on_ = {std::chrono::steady_clock::now(), frame_.time};
  }

  // Tells the tracker how far the camera was told to turn since the last image that was tracked.
  void FollowHead() {
    Head* const head = run_.camera->source->head();
    if (head == nullptr) return;
    const engine::Rotation3 now = CarrierFromCamera(head->At(frame_.time));
    constexpr double kStill_rad = 1e-4;
    if (before_) {
      const engine::Rotation3 turn = now.inverse() * *before_;
      if (turn.Angle() > kStill_rad) frame_.turned = turn;
    }
    before_ = now;
  }

  // Judged before an image is fetched: one that is slow to make (a simulation on a busy machine) is as old
  // as it is, but those that would be late were it there at once are passed over.
  bool MustBeLate() {
    return run_.options.pace == Pace::kRealtime && !live_ && first_time_ &&
           clock_->IsLate(frame_.time + period_, period_);
  }

  void TellLatency() {
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
  std::optional<engine::Rotation3> before_;  // carrier_from_camera of the head at the last tracked image
  const bool live_;
  const Timestamp period_;
  Commander commander_;
  GapReporter gaps_;
  engine::Frame frame_;
  bool late_ = false;  // the image is to be dropped
  std::optional<Timestamp> first_time_;
  Timestamp clock_offset_{};
  // Eager: when the image before was handed on, and its own time.
  std::optional<std::pair<std::chrono::steady_clock::time_point, Timestamp>> handed_on_;
  std::string trouble_;
};

// All cameras on this thread, always the one whose image is the oldest; the first of two that are as old.
void TakeTurns(std::vector<CameraFeed>* feeds, const std::stop_token& stop) {
  std::vector<CameraFeed*> going;
  for (CameraFeed& feed : *feeds) going.push_back(&feed);
  while (!stop.stop_requested()) {
    const auto oldest = std::min_element(going.begin(), going.end(),
                                         [](const auto* a, const auto* b) { return a->time() < b->time(); });
    (*oldest)->Handle(stop);
    if ((*oldest)->Fetch(stop)) continue;
    if (*oldest == &feeds->front()) return;
    going.erase(oldest);
  }
}

void RunSideBySide(std::vector<CameraFeed>* feeds, Pace pace, std::stop_source* stopping) {
  const std::stop_token stop = stopping->get_token();
  ImageGate gate(feeds->size(), feeds->front().period());
  for (std::size_t i = 0; i < feeds->size(); ++i) {
    if ((*feeds)[i].live()) gate.Leave(i);  // devices keep time together by themselves
  }
  const auto run = [&](std::size_t i) {
    CameraFeed& feed = (*feeds)[i];
    try {
      do {
        if (pace == Pace::kEager && !feed.live()) gate.Wait(i, feed.time(), stop);
        feed.Handle(stop);
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
  // Not before all first images are there, or those who had to wait for the others would begin too late.
  clock.Start(feeds.front().time());
  const Pace pace = cameras.front().options.pace;
  if (pace == Pace::kLockstep) {
    TakeTurns(&feeds, stopping.get_token());
  } else {
    RunSideBySide(&feeds, pace, &stopping);
  }
  if (stop.stop_requested()) return;
  for (const CameraFeed& feed : feeds) feed.CheckAllDone();
}

void RunFrames(CalibratedCamera* camera, Session* session, const FrameLoopOptions& options,
               const FrameCallback& shown, const std::stop_token& stop) {
  RunCameras({{camera, options, shown}}, session, stop);
}

}  // namespace docent::app
