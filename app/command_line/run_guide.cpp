// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_guide.h"

#include <utility>

#include "app/cameras/clipped_source.h"
#include "app/command_line/guide_files.h"
#include "app/command_line/guide_window.h"
#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "engine/base/error.h"
#include "engine/base/worker.h"
#include "ui/context.h"

namespace docent::app {

namespace {

// Draws without a window, for a video or for whoever wants pictures.
class OffscreenView {
 public:
  OffscreenView(const GuideRequest& request, double frames_per_second) : request_(request) {
    if (request.record) recorder_.emplace(*request.record, frames_per_second);
  }

  void Add(const ShownFrame& frame, const engine::CameraModel& camera) {
    if (frame.tracked.state == engine::TrackingState::kDropped) return;
    renderer_.Draw(ViewOf(frame, camera));
    renderer_.ReadBack(&picture_);
    if (recorder_) recorder_->Write(picture_, frame.tracked.frame.index);
    if (request_.on_picture) request_.on_picture(frame, picture_);
  }
  void Close() {
    if (recorder_) recorder_->Close();
  }

 private:
  const GuideRequest& request_;
  ui::OffscreenContext context_;
  ui::Renderer renderer_;
  std::optional<ViewRecorder> recorder_;
  cv::Mat picture_;
};

// One run: the camera's loop with the files it leaves. Everything here is on the camera's thread.
class GuideRun {
 public:
  GuideRun(const GuideRequest& request, CalibratedCamera* camera)
      : request_(request), camera_(camera), session_(OptionsOf(request), {camera->model}, request.library) {
    loop_.pace = request.pace;
    loop_.script = request.script;
    loop_.script_name = request.script_name;
    loop_.model_folder = request.model_folder;
    loop_.inbox = &inbox_;
    loop_.refused = [this](const std::string& reason) { message_ = reason; };
  }

  using Show = std::function<void(std::shared_ptr<const ShownFrame>)>;

  // Whatever happens, what was built is saved and the files are closed; then the first fault is thrown.
  void Run(const Show& show, std::stop_token window_closed) {
    GuideFiles files(request_, *camera_->model);
    loop_.carried_out = [&](const TimedCommand& command) {
      message_.clear();
      files.Add(command);
    };
    std::stop_source stop;
    const std::stop_callback forward(window_closed, [&stop] { stop.request_stop(); });
    std::exception_ptr fault;
    const auto guarded = [&fault](const auto& action) {
      try {
        action();
      } catch (...) {
        if (!fault) fault = std::current_exception();
      }
    };
    guarded([&] {
      RunFrames(
          camera_, &session_, loop_,
          [&](const engine::TrackedFrame& tracked) {
            if (Interruption::requested()) stop.request_stop();
            auto frame = MakeShown(tracked);
            files.Add(*frame);
            files.Add(session_.TakeEvents());
            if (request_.on_frame) request_.on_frame(*frame);
            Direct(frame);
            show(std::move(frame));
          },
          stop.get_token());
    });
    guarded([&] { session_.Finish(); });
    guarded([&] {
      files.Add(session_.TakeEvents());
      files.Close();
    });
    if (fault) std::rethrow_exception(fault);
  }

  CommandInbox* inbox() { return &inbox_; }
  std::vector<Session::MapState> Maps() const { return session_.Maps(); }

 private:
  static SessionOptions OptionsOf(const GuideRequest& request) {
    SessionOptions options;
    options.threaded = request.pace != Pace::kLockstep;
    options.may_write = request.may_write;
    options.seed = request.seed;
    options.autosave_interval = request.autosave_interval;
    options.memory.budget_bytes = request.memory_budget_bytes;
    options.memory.wait_for_maps = request.pace != Pace::kRealtime;
    return options;
  }

  void Direct(const std::shared_ptr<const ShownFrame>& frame) {
    if (!request_.director) return;
    const std::shared_ptr<const engine::TrackedFrame> tracked(frame, &frame->tracked);
    for (Command& command : request_.director(*frame)) inbox_.Push({std::move(command), tracked});
  }

  std::shared_ptr<ShownFrame> MakeShown(const engine::TrackedFrame& tracked) {
    auto frame = std::make_shared<ShownFrame>();
    frame->tracked = tracked;
    frame->shown = session_.ShownWith(tracked);
    if (!first_time_) first_time_ = tracked.frame.time;
    frame->seconds = ToSeconds(tracked.frame.time - *first_time_);
    frame->message = message_;
    return frame;
  }

  const GuideRequest& request_;
  CalibratedCamera* const camera_;
  Session session_;
  FrameLoopOptions loop_;
  CommandInbox inbox_;
  std::optional<Timestamp> first_time_;
  std::string message_;
};

void RunHeadless(const GuideRequest& request, CalibratedCamera* camera, GuideRun* run, Verbosity verbosity) {
  const SourceInfo& info = camera->source->info();
  std::optional<OffscreenView> view;
  if (request.record || request.on_picture) view.emplace(request, info.nominal_fps);
  Progress progress(info.name, info.frame_count, verbosity);
  std::uint64_t count = 0;
  run->Run(
      [&](std::shared_ptr<const ShownFrame> frame) {
        if (view) view->Add(*frame, *camera->model);
        progress.Update(++count);
      },
      {});
  if (view) view->Close();
}

void RunWindowed(const GuideRequest& request, CalibratedCamera* camera, GuideRun* run) {
  FrameSlot slot;
  const double frames_per_second = camera->source->info().nominal_fps;
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
    ShowInWindow(request, *camera->model, frames_per_second, &slot, run->inbox());
  } catch (...) {
    fault = std::current_exception();
  }
  worker.RequestStop();
  if (fault) {
    // The window's fault came first; the camera's thread still saves before anybody hears of it.
    try {
      worker.Join();
    } catch (const Error&) {
    }
    std::rethrow_exception(fault);
  }
  worker.Join();
}

}  // namespace

std::vector<Session::MapState> RunGuide(const GuideRequest& request, CalibratedCamera* camera,
                                        Verbosity verbosity) {
  const Interruption interruption;
  GuideRun run(request, camera);
  if (request.headless) {
    RunHeadless(request, camera, &run, verbosity);
  } else {
    RunWindowed(request, camera, &run);
  }
  return run.Maps();
}

CalibratedCamera OpenArgumentCamera(const RunArguments& run) {
  if (run.cameras.sources.size() > 1) {
    throw Error("This version tracks one camera at a time; give --camera once.");
  }
  CameraOptions options = run.cameras.options;
  options.seed = run.seed;
  auto source = OpenCamera(run.cameras.sources.front(), options);
  if (run.cameras.from > Timestamp{} || run.cameras.until > Timestamp{}) {
    source = ClipSource(std::move(source), run.cameras.from, run.cameras.until);
  }
  std::optional<std::filesystem::path> calibration;
  if (!run.cameras.calibrations.empty()) calibration = run.cameras.calibrations.front();
  return Calibrate(std::move(source), calibration);
}

}  // namespace docent::app
