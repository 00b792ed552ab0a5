// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_guide.h"

#include <spdlog/spdlog.h>

#include <exception>
#include <mutex>
#include <utility>

#include "app/cameras/clipped_source.h"
#include "app/command_line/guide_run.h"
#include "app/command_line/guide_window.h"
#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "app/files/checked_file.h"
#include "engine/base/error.h"
#include "engine/base/worker.h"
#include "ui/context.h"

namespace docent::app {

namespace {

ui::RendererOptions OptionsFor(const GuideRequest& request) {
  ui::RendererOptions options;
  options.language = request.language;
  return options;
}

// Draws frames without a window, for the video and for GuideRequest::on_image.
class OffscreenView {
 public:
  OffscreenView(const GuideRequest& request, double frames_per_second)
      : request_(request), renderer_(OptionsFor(request)) {
    if (request.record) recorder_.emplace(*request.record, frames_per_second);
  }

  // Draws a frame. `other` is the newest frame of the second camera, with its lens, and may be null. Returns
  // false for a frame that is not drawn, because it was dropped or drawn before.
  bool Add(const ShownFrame& frame, const engine::CameraModel& camera, const ShownFrame* other,
           const engine::CameraModel& other_camera) {
    const std::uint64_t index = frame.tracked.frame.index;
    if (frame.tracked.state == engine::TrackingState::kDropped || last_index_ == index) return false;
    last_index_ = index;
    ui::View view = ViewOf(frame, camera);
    if (other != nullptr) AddOther(*other, other_camera, VisitorStringsFor(request_.language), &view);
    renderer_.Draw(view);
    renderer_.ReadBack(&image_);
    if (recorder_) recorder_->Write(image_, frame.tracked.frame.index);
    if (request_.on_image) request_.on_image(frame, image_);
    return true;
  }
  void Close() {
    if (recorder_) recorder_->Close();
  }

 private:
  const GuideRequest& request_;
  ui::OffscreenContext context_;
  ui::Renderer renderer_;
  std::optional<ViewRecorder> recorder_;
  std::optional<std::uint64_t> last_index_;
  cv::Mat image_;
};

void RunHeadless(const GuideRequest& request, std::span<CalibratedCamera> cameras, GuideRun* run,
                 Verbosity verbosity) {
  const SourceInfo& info = cameras.front().source->info();
  std::optional<OffscreenView> view;
  if (request.record || request.on_image) view.emplace(request, info.nominal_fps);
  Progress progress(info.name, info.frame_count, verbosity);
  std::uint64_t count = 0;
  std::mutex other_mutex;
  std::shared_ptr<const ShownFrame> other;
  run->Run(
      [&](std::shared_ptr<const ShownFrame> frame) {
        // The first camera runs on this thread, which owns the OpenGL context.
        if (frame->tracked.frame.camera != 0) {
          if (frame->tracked.state == engine::TrackingState::kDropped) return;
          const std::scoped_lock lock(other_mutex);
          other = std::move(frame);
          return;
        }
        std::shared_ptr<const ShownFrame> inset;
        {
          const std::scoped_lock lock(other_mutex);
          inset = other;
        }
        if (view && view->Add(*frame, *cameras.front().model, inset.get(), *cameras.back().model))
          for (const FrameStage stage : {FrameStage::kDrawn, FrameStage::kShown}) run->Reached(stage, *frame);
        progress.Update(++count);
      },
      {});
  if (view) view->Close();
}

void RunWindowed(const GuideRequest& request, std::span<CalibratedCamera> cameras, GuideRun* run) {
  FrameSlot slot(cameras.size());
  Worker worker("camera", [&](const std::stop_token& stop) {
    try {
      run->Run([&](std::shared_ptr<const ShownFrame> frame) { slot.Put(std::move(frame)); }, stop);
    } catch (...) {
      slot.Close();
      throw;
    }
    slot.Close();
  });
  std::exception_ptr fault;
  try {
    WindowLink link;
    link.inboxes = run->inboxes();
    link.notices = run->notices();
    link.saving = [run] { return run->Saving(); };
    link.maps = [run] { return run->MapsForWindow(); };
    link.scene_of = [run](std::uint64_t map_key) { return run->SceneOf(map_key); };
    link.discard_changes = [run] { run->DiscardChanges(); };
    link.toggle_pause = [run] { run->TogglePause(); };
    link.toggle_fast_forward = [run] { run->ToggleFastForward(); };
    link.lead = [run](std::size_t camera, const GuideVisitor& guide) { return run->Lead(camera, guide); };
    link.used = [run] { run->Used(); };
    link.adapted = [run](const std::string& text) { run->Adapted(text); };
    link.reached = [run](FrameStage stage, const ShownFrame& frame) { run->Reached(stage, frame); };
    ShowInWindow(request, cameras, &slot, link);
  } catch (...) {
    fault = std::current_exception();
  }
  worker.RequestStop();
  if (fault) {
    // The window's error came first. The camera thread still saves its results before that error is thrown,
    // and its own error may say which maps are lost.
    try {
      worker.Join();
    } catch (const std::exception& error) {
      spdlog::error("{}", error.what());
    }
    std::rethrow_exception(fault);
  }
  worker.Join();
}

}  // namespace

std::vector<Session::MapState> RunGuide(const GuideRequest& request, std::span<CalibratedCamera> cameras,
                                        Verbosity verbosity) {
  const Interruption interruption;
  // A kiosk starts again by itself, and must not erase the recording that shows why.
  if (!request.kiosk_code.empty() && request.record) KeepEarlier(*request.record);
  if (request.library != nullptr) LoadKnownLenses(*request.library, cameras);
  GuideRun run(request, cameras);
  if (request.headless) {
    RunHeadless(request, cameras, &run, verbosity);
  } else {
    RunWindowed(request, cameras, &run);
  }
  return run.Maps();
}

std::vector<CalibratedCamera> OpenArgumentCameras(const RunArguments& run) {
  CameraOptions options = run.cameras.options;
  options.seed = run.seed;
  options.reconnect = true;
  options.lock_controls_after = kImagesUntilSettled;
  std::vector<CalibratedCamera> cameras;
  for (std::size_t i = 0; i < run.cameras.sources.size(); ++i) {
    auto source = OpenCamera(run.cameras.sources[i], options);
    if (run.cameras.from > Timestamp{} || run.cameras.until > Timestamp{}) {
      source = ClipSource(std::move(source), run.cameras.from, run.cameras.until);
    }
    std::optional<std::filesystem::path> calibration;
    if (i < run.cameras.calibrations.size()) calibration = run.cameras.calibrations[i];
    cameras.push_back(Calibrate(std::move(source), calibration));
  }
  return cameras;
}

}  // namespace docent::app
