// SPDX-License-Identifier: Apache-2.0
#include "app/session/camera_feed.h"

#include <algorithm>

namespace docent::app {

void GapReporter::Report(const engine::Frame& frame, const FrameCallback& shown) {
  const auto last = std::exchange(last_, std::pair(frame.index, frame.time));
  if (!last || frame.index <= last->first + 1) return;
  const std::uint64_t steps = frame.index - last->first;
  if (steps > kMostSteps) return;
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

bool CameraFeed::Fetch(const std::stop_token& stop) {
  FrameSource& source = *run_.camera->source;
  while (!stop.stop_requested()) {
    if (untracked_ && untracked_->has_ended()) return false;
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
    if (frame_.image.empty()) {
      ContinueDisconnected();
      continue;
    }
    if (live_) gaps_.Report(frame_, run_.shown);
    if (!first_time_) {
      first_time_ = frame_.time;
      run_.camera->CheckImage(frame_.image);
    }
    return true;
  }
  return false;
}

void CameraFeed::SetClockOffset(Timestamp offset) {
  clock_offset_ = offset;
  frame_.time -= offset;
  *first_time_ -= offset;
}

void CameraFeed::Handle(const std::stop_token& stop) {
  const Pace pace = run_.options.pace;
  engine::TrackedFrame tracked;
  // Only recordings are paced: a device drops images that are not fetched in time.
  if (late_) {
    tracked.frame = frame_;
    tracked.state = engine::TrackingState::kDropped;
    run_.shown(tracked);
    CarryOutGiven();
    return;
  }
  if (pace == Pace::kRealtime && !live_) clock_->WaitFor(frame_.time, stop);
  if (pace == Pace::kEager) WaitForMapper(stop);
  if (pace != Pace::kRealtime) {
    if (run_.options.no_faster_than_times && !live_) WaitForTime(stop);
    last_processed_ = {std::chrono::steady_clock::now(), frame_.time};
  }
  SetHeadRotation();
  tracked = Track();
  ReportLatency();
  command_runner_.RunDue(frame_.time - *first_time_, tracked);
  run_.shown(tracked);
  ReportUntracked();
  last_tracked_ = std::move(tracked);
}

engine::TrackedFrame CameraFeed::Track() {
  if (!untracked_) return session_->Process(frame_);
  // After an image with content, the content stays in place for this long (VisitTimes::held), and its
  // image with it. Else an image stays for less than a fifth of a second, until the next one is drawn.
  constexpr std::chrono::milliseconds kHeld{500}, kWithout{150};
  const bool has_content = last_tracked_ && engine::HasPose(last_tracked_->state);
  engine::TrackedFrame tracked;
  untracked_->During([&] { tracked = session_->Process(frame_); }, has_content ? kHeld : kWithout,
                     frame_.time, clock_offset_);
  return tracked;
}

void CameraFeed::ReportUntracked() {
  if (!untracked_) return;
  for (engine::Frame& frame : untracked_->TakeFetched()) {
    if (live_) gaps_.Report(frame, run_.shown);
    frame_ = frame;  // The time after which the next image is due.
    engine::TrackedFrame dropped;
    dropped.frame = std::move(frame);
    dropped.state = engine::TrackingState::kDropped;
    run_.shown(dropped);
  }
}

void CameraFeed::CarryOutGiven(bool waits) {
  if (last_tracked_)
    command_runner_.RunGiven(last_tracked_->frame.time - *first_time_, *last_tracked_, waits);
}

void CameraFeed::Disconnect() {
  session_->Disconnect(static_cast<std::size_t>(run_.options.camera));
}

void CameraFeed::ContinueDisconnected() {
  Disconnect();
  CarryOutGiven();
  if (last_tracked_) session_->Idle(std::max(frame_.time, last_tracked_->frame.time));
  if (run_.options.disconnected) run_.options.disconnected(last_tracked_ ? &*last_tracked_ : nullptr);
}

void CameraFeed::Pause(const std::stop_token& stop) {
  const auto begin = std::chrono::steady_clock::now();
  while (run_.options.idle && clock_->IsStopped() && !stop.stop_requested()) {
    CarryOut(std::chrono::steady_clock::now() - begin, false);
    Rest(stop);
  }
}

void CameraFeed::CarryOut(Timestamp passed, bool at_end) {
  if (!run_.options.idle || !last_tracked_) return;
  command_runner_.RunDue(last_tracked_->frame.time - *first_time_, *last_tracked_);
  // The last images of several cameras may be far apart, and the times of a session do not decrease.
  if (!at_end || run_.options.camera == 0) session_->Idle(last_tracked_->frame.time + passed);
  run_.options.idle(*last_tracked_, at_end);
}

void CameraFeed::Rest(const std::stop_token& stop) {
  constexpr auto kInterval = std::chrono::milliseconds(33);
  PlayClock machine;
  machine.WaitUntil(machine.Now() + kInterval, stop);
}

std::chrono::steady_clock::time_point CameraFeed::DueAfterLast() const {
  if (!last_processed_) return std::chrono::steady_clock::now();
  return last_processed_->first + (frame_.time - last_processed_->second);
}

void CameraFeed::WaitForMapper(const std::stop_token& stop) {
  session_->WaitUntilIdle(DueAfterLast(), stop);
}

void CameraFeed::WaitForTime(const std::stop_token& stop) {
  if (clock_->IsFastForward()) return;
  PlayClock machine;
  machine.WaitUntil(machine.Now() + (DueAfterLast() - std::chrono::steady_clock::now()), stop);
}

void CameraFeed::SetHeadRotation() {
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

bool CameraFeed::WillBeLate() {
  if (run_.options.pace != Pace::kRealtime || live_ || !first_time_) return false;
  const std::optional<Timestamp> next = run_.camera->source->NextTime();
  return clock_->IsLate(next ? *next - clock_offset_ : frame_.time + period_, period_);
}

void CameraFeed::ReportLatency() {
  if (!run_.options.latency) return;
  if (live_) {
    run_.options.latency(clock_->Now() - (frame_.time + clock_offset_));
  } else if (run_.options.pace == Pace::kRealtime) {
    run_.options.latency(clock_->Now() - clock_->Due(frame_.time));
  }
}

}  // namespace docent::app
