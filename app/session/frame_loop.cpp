// SPDX-License-Identifier: Apache-2.0
#include "app/session/frame_loop.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include "engine/base/error.h"

namespace docent::app {

namespace {

using Clock = std::chrono::steady_clock;

// Plays pictures by their own times.
class RealtimeClock {
 public:
  explicit RealtimeClock(const SourceInfo& info)
      : live_(info.live), period_(FromSeconds(1.0 / info.nominal_fps)) {}

  // Waits until the picture is due. False when its successor is due already.
  bool WaitFor(Timestamp time, const std::stop_token& stop) {
    if (live_) return true;  // a device keeps time itself, and drops what nobody fetches
    const Clock::time_point now = Clock::now();
    if (!start_) start_ = now - time;
    const Clock::time_point due = *start_ + time;
    if (now > due + period_) return false;
    std::unique_lock lock(mutex_);
    woken_.wait_until(lock, stop, due, [] { return false; });
    return true;
  }

 private:
  const bool live_;
  const Timestamp period_;
  std::optional<Clock::time_point> start_;  // when a picture of time 0 would have been due
  std::mutex mutex_;
  std::condition_variable_any woken_;
};

// Carries out what is due, from the script and from the inbox, and tells of it.
class Commander {
 public:
  Commander(const FrameLoopOptions& options, Session* session)
      : options_(options), session_(session), next_(options.script.begin()) {}

  // now: from the first picture.
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

  // Nothing of the script may be left when the pictures have ended.
  void CheckAllDone() const {
    if (next_ == options_.script.end()) return;
    throw Error(Line(*next_) + "the pictures ended before the time of this command.");
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

// Hands on what a source lost before this picture, as its index tells. After an absence the index goes on
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

}  // namespace

void RunFrames(CalibratedCamera* camera, Session* session, const FrameLoopOptions& options,
               const std::function<void(const engine::TrackedFrame&)>& shown, const std::stop_token& stop) {
  PreloadModels(options, session);
  RealtimeClock clock(camera->source->info());
  std::optional<Timestamp> first_time;
  Commander commander(options, session);
  GapReporter gaps;
  std::string trouble;
  engine::Frame frame;
  while (!stop.stop_requested() && camera->source->Next(&frame)) {
    frame.camera = options.camera;
    if (std::string now = camera->source->trouble(); now != trouble) {
      trouble = std::move(now);
      if (options.trouble) options.trouble(trouble, frame.time);
    }
    if (frame.picture.empty()) continue;
    if (camera->source->info().live) gaps.Report(frame, shown);
    if (!first_time) {
      first_time = frame.time;
      camera->CheckPicture(frame.picture);
    }
    engine::TrackedFrame tracked;
    if (options.pace == Pace::kRealtime && !clock.WaitFor(frame.time - *first_time, stop)) {
      tracked.frame = frame;
      tracked.state = engine::TrackingState::kDropped;
      shown(tracked);
      continue;
    }
    // A file delivers faster than a camera and would run away from the mapper, which in the world has the
    // whole time between pictures; so whoever feeds waits, never the tracker.
    if (options.pace == Pace::kEager) session->WaitUntilCalm(stop);
    tracked = session->Process(frame);
    commander.CarryOutDue(frame.time - *first_time, tracked);
    shown(tracked);
    frame = engine::Frame();
  }
  if (!stop.stop_requested()) commander.CheckAllDone();
}

}  // namespace docent::app
