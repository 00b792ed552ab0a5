// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "app/session/command_runner.h"
#include "app/session/frame_loop.h"
#include "app/session/play_clock.h"
#include "app/session/untracked_images.h"

namespace docent::app {

// Reports the images that a source lost before this one, from the gap in the indices. While a device is away
// its index does not advance, so no frames are invented for that time.
class GapReporter {
 public:
  // Calls `shown` with a dropped frame for each image that is missing between the last one and this one. A
  // jump over more images than a camera can lose is none of images, and is not reported.
  void Report(const engine::Frame& frame, const FrameCallback& shown);

 private:
  static constexpr std::uint64_t kMostSteps = 10'000;
  std::optional<std::pair<std::uint64_t, Timestamp>> last_;
};

// One camera of a session, processed image by image. On the camera's thread.
class CameraFeed {
 public:
  // The arguments must outlive this object.
  CameraFeed(const CameraRun& run, Session* session, RealtimeClock* clock)
      : run_(run),
        session_(session),
        clock_(clock),
        live_(run.camera->source->info().live),
        period_(FromSeconds(1 / run.camera->source->info().nominal_fps)),
        command_runner_(run.options, session) {
    if (run.options.untracked && run.options.pace == Pace::kRealtime)
      untracked_ = std::make_unique<UntrackedImages>(run.camera->source.get(), clock, run.options.camera,
                                                     run.options.untracked);
  }

  // Gets the next image; false at the end of the source or when stop is requested.
  bool Fetch(const std::stop_token& stop);
  // When the image of the last Fetch was taken, on the clock of the first camera.
  Timestamp time() const { return frame_.time; }
  // The nominal time between two images.
  Timestamp period() const { return period_; }
  // Whether the source is a device, which does not wait.
  bool live() const { return live_; }
  // To be called between the first Fetch and the first Handle, with the lead of this source's clock.
  void SetClockOffset(Timestamp offset);
  // Processes the image of the last Fetch.
  void Handle(const std::stop_token& stop);
  // Goes on with the last image while the clock is stopped.
  void Pause(const std::stop_token& stop);
  // Carries out what the person wants while there is no other image, `passed` after the last one. At the end,
  // the session's time is that of the first camera.
  void CarryOut(Timestamp passed, bool at_end);
  // Carries out what the person wanted since the last image: while images are dropped or missing, and after
  // the last one. waits: for files that have to be read.
  void CarryOutGiven(bool waits = false);
  // The time between two calls of CarryOut.
  static void Rest(const std::stop_token& stop);
  // There are no more images of this camera, while others go on.
  void Disconnect();
  // Throws Error if the images ended before the last command of the script.
  void CheckAllDone() const { command_runner_.CheckAllDone(); }

 private:
  // A file delivers faster than a camera, and would run ahead of the mapper, which with a real camera has the
  // whole time between images. The source waits therefore, never the tracker.
  void WaitForMapper(const std::stop_token& stop);
  // See FrameLoopOptions::no_faster_than_times.
  void WaitForTime(const std::stop_token& stop);
  // When as much time has passed since the last image as lies between it and this one; now for the first.
  std::chrono::steady_clock::time_point DueAfterLast() const;
  // Tells the tracker how far the head was commanded to rotate since the last tracked image.
  void SetHeadRotation();
  // Decided before an image is fetched: an image that is slow to produce (a simulation on a busy machine) is
  // tracked although it is old, but images that would be late even if they were available at once are
  // skipped.
  bool WillBeLate();
  void ReportLatency();
  // Tracks the image of the last Fetch, and meanwhile shows others if that takes long.
  engine::TrackedFrame Track();
  // Passes on what was fetched meanwhile.
  void ReportUntracked();
  // The device may stay away for long, but the person is still there.
  void ContinueDisconnected();

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
  // When the previous image was processed, and its own time; not in realtime.
  std::optional<std::pair<std::chrono::steady_clock::time_point, Timestamp>> last_processed_;
  std::optional<engine::TrackedFrame> last_tracked_;
  std::string trouble_;
  std::unique_ptr<UntrackedImages> untracked_;  // Null if no images are fetched during others.
};

}  // namespace docent::app
