// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_guide.h"
#include "app/session/visit_state.h"
#include "app/sound/sound_director.h"
#include "app/sound/sound_player.h"

#include <algorithm>
#include <cctype>
#include <mutex>
#include <set>
#include <utility>

#include "app/cameras/clipped_source.h"
#include "app/command_line/guide_files.h"
#include "app/command_line/guide_window.h"
#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "app/evaluation/camera_report.h"
#include "app/files/text_file.h"
#include "app/output/engine_text.h"
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

  // Draws a frame. `other` is the newest frame of the second camera and may be null. Returns false for a
  // frame that is not drawn, because it was dropped or drawn before.
  bool Add(const ShownFrame& frame, const engine::CameraModel& camera, const ShownFrame* other) {
    const std::uint64_t index = frame.tracked.frame.index;
    if (frame.tracked.state == engine::TrackingState::kDropped || last_index_ == index) return false;
    last_index_ = index;
    ui::View view = ViewOf(frame, camera);
    if (other != nullptr) view.overlay.inset = &other->tracked;
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

// Delivery statistics of a live camera for events.csv.
std::string DeliveryText(const SourceInfo& info, const Delivery& delivery) {
  return info.name + ": " + std::to_string(delivery.delivered) + " images delivered, " +
         std::to_string(delivery.missed) + " missed by the device, " + std::to_string(delivery.late) +
         " replaced by newer ones, " + std::to_string(delivery.broken) + " broken, " +
         std::to_string(delivery.reconnections) + " reconnections, latency " +
         FormatNumber(1e3 * ToSeconds(delivery.median_latency), 3) + " ms";
}

// "there is no map" becomes "There is no map."
std::string SentenceOf(std::string text) {
  if (text.empty()) return text;
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (!text.ends_with('.')) text += '.';
  return text;
}

std::vector<std::shared_ptr<const engine::CameraModel>> ModelsOf(std::span<CalibratedCamera> cameras) {
  std::vector<std::shared_ptr<const engine::CameraModel>> models;
  for (const CalibratedCamera& camera : cameras) models.push_back(camera.model);
  return models;
}

// One run: the frame loops of the cameras and the files they write.
class GuideRun {
 public:
  GuideRun(const GuideRequest& request, std::span<CalibratedCamera> cameras)
      : request_(request),
        cameras_(cameras),
        session_(OptionsOf(request, cameras), ModelsOf(cameras), request.library),
        inboxes_(cameras.size()),
        camera_states_(cameras.size()),
        sound_director_(request.language) {
    if (request.sound) sound_player_.emplace();
    for (const CalibratedCamera& camera : cameras) tallies_.emplace_back(camera.source->info().name);
    if (!request.head) return;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      if (Head* const head = cameras[i].source->head())
        heads_.push_back(
            std::make_unique<HeadControl>(head, static_cast<int>(i), cameras[i].model, *request.head));
    }
    if (heads_.empty()) throw Error("No camera has a pan-tilt head; remove --head.");
  }

  // Called on the thread of the frame's camera.
  using Show = std::function<void(std::shared_ptr<const ShownFrame>)>;

  // Saves the maps and closes the files in any case; then throws the first error that occurred.
  void Run(const Show& show, std::stop_token window_closed) {
    files_.emplace(request_, *cameras_.front().model);
    const std::stop_callback forward(window_closed, [this] { stop_.request_stop(); });
    WarnAboutUnknownLenses();
    std::exception_ptr fault;
    const auto guarded = [&fault](const auto& action) {
      try {
        action();
      } catch (...) {
        if (!fault) fault = std::current_exception();
      }
    };
    guarded([&] {
      std::vector<CameraRun> runs;
      for (std::size_t i = 0; i < cameras_.size(); ++i) runs.push_back(RunOf(i, show));
      RunCameras(runs, &session_, stop_.get_token());
    });
    guarded([&] { session_.Finish(); });
    guarded([&] {
      files_->Add(session_.TakeEvents());
      for (std::size_t i = 0; i < cameras_.size(); ++i) {
        const FrameSource& source = *cameras_[i].source;
        if (source.info().live) tallies_[i].SetDelivery(source.delivery());
        if (source.info().live && camera_states_[i].last)
          files_->Add({Event{camera_states_[i].last->tracked.frame.time, "camera",
                             DeliveryText(source.info(), source.delivery())}});
      }
      files_->Close();
    });
    guarded([&] {
      const std::scoped_lock lock(files_mutex_);
      if (request_.output) WriteCameraReport(*request_.output / "report.json", tallies_);
    });
    if (fault) std::rethrow_exception(fault);
  }

  // Records the latency of a frame that is now on the screen or in the video. Any thread.
  void Drawn(const ShownFrame& frame) {
    if (!frame.taken) return;
    const Timestamp age = PlayClock().Now() - *frame.taken;
    const std::scoped_lock lock(files_mutex_);
    tallies_[static_cast<std::size_t>(frame.tracked.frame.camera)].AddDrawnAge(age);
  }

  std::span<CommandInbox> inboxes() { return inboxes_; }
  // For the author's window; without one they are not filled.
  NoticeQueue* notices() { return &notices_; }
  SavingState Saving() const {
    const Session::Saving saving = session_.SavingNow();
    return {saving.unsaved, saving.saved_at};
  }
  std::vector<ui::MapFacts> MapsForWindow() const {
    std::vector<ui::MapFacts> all;
    for (const Session::MapState& map : session_.Maps()) {
      if (map.discarded || map.joined_into != 0) continue;
      ui::MapFacts facts;
      facts.name = map.name;
      facts.policy = maps::ToString(map.policy);
      facts.is_initialized = map.snapshot || map.in_library;
      facts.objects_known = map.snapshot != nullptr;
      if (map.snapshot) facts.keyframes = map.snapshot->keyframes.size();
      if (map.scene) facts.objects = map.scene->entities.size();
      all.push_back(std::move(facts));
    }
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return all;
  }
  void DiscardChanges() { session_.DiscardChanges(); }
  std::vector<Session::MapState> Maps() const { return session_.Maps(); }

 private:
  // State of one camera; used on its thread only.
  struct CameraState {
    std::optional<Timestamp> first_time;
    std::optional<Timestamp> age;  // Age of the last tracked image when its tracking ended.
    std::string message;
    std::shared_ptr<const ShownFrame> last;
    std::optional<VisitState> visit;  // Only on a tour.
    std::shared_ptr<const ShownFrame> last_with_pose;
  };

  static SessionOptions OptionsOf(const GuideRequest& request, std::span<CalibratedCamera> cameras) {
    SessionOptions options;
    options.threaded = request.pace != Pace::kLockstep;
    options.may_write = request.may_write;
    options.new_map_when_lost = request.new_map_when_lost;
    options.seed = request.seed;
    options.tracker.hybrid = request.engine == EngineKind::kHybrid;
    options.autosave_interval = request.autosave_interval;
    options.memory.budget_bytes = request.memory_budget_bytes;
    options.memory.wait_for_maps = request.pace != Pace::kRealtime;
    options.baseline_m = request.baseline_m;
    options.tracker.target = request.target;
    options.mapper.lens.lenses = EstimatedLensesOf(cameras);
    return options;
  }

  std::vector<std::string> StopNames() const {
    std::vector<std::string> names;
    if (request_.library == nullptr) return names;
    for (const maps::MapInfo& map : request_.library->List()) names.push_back(map.name);
    return names;
  }

  // A tour builds no map, so it cannot estimate a calibration.
  void WarnAboutUnknownLenses() {
    if (request_.may_write) return;
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const auto& lens = cameras_[i].estimated_lens;
      if (!lens || lens->fixed) continue;
      const bool unknown = lens->focal_sigma > engine::LensEstimationOptions().max_sigma;
      const std::string assumption =
          unknown ? "is not in this library, so a field of view of " +
                        FormatNumber(engine::kUnknownFieldOfView_deg, 3) + " degrees is assumed"
                  : "is only a rough estimate, with a focal length of " + FormatFocalLength(*lens);
      const std::string warning =
          "The calibration of camera \"" + lens->name + "\" " + assumption +
          ". Build a map with this camera, or give its calibration with --calibration FILE.";
      files_->Add({Event{{}, "warning", warning}});
      camera_states_[i].message = warning;
    }
  }

  CameraRun RunOf(std::size_t i, const Show& show) {
    CameraState& state = camera_states_[i];
    if (!request_.may_write) state.visit.emplace(StopNames());
    CameraRun run;
    run.camera = &cameras_[i];
    run.options.pace = request_.pace;
    run.options.camera = static_cast<int>(i);
    if (i == 0) {
      run.options.script = request_.script;
      run.options.script_name = request_.script_name;
    }
    run.options.model_folder = request_.model_folder;
    run.options.inbox = &inboxes_[i];
    run.options.refused = [this, &state](const std::string& reason) {
      if (has_author_window()) {
        notices_.Push({SentenceOf(reason), std::nullopt});
      } else {
        state.message = reason;
      }
    };
    run.options.carried_out = [this, &state](const TimedCommand& command) {
      if (has_author_window()) {
        notices_.Push({"", command.command});
      } else {
        state.message.clear();
      }
      const std::scoped_lock lock(files_mutex_);
      files_->Add(command);
    };
    run.options.trouble = [this, &state, &show](const std::string& sentence, Timestamp time) {
      state.message = sentence;
      {
        const std::scoped_lock lock(files_mutex_);
        files_->Add({Event{time, "camera", sentence.empty() ? "The camera is back." : sentence}});
      }
      if (!state.last) return;
      // There is no new image, so the last one is shown again with the message.
      auto frame = std::make_shared<ShownFrame>(*state.last);
      frame->message = sentence;
      show(std::move(frame));
    };
    run.options.latency = [&state](Timestamp age) { state.age = age; };
    run.shown = [this, &state, &show](const engine::TrackedFrame& tracked) {
      if (Interruption::requested()) stop_.request_stop();
      const std::optional<Timestamp> age = std::exchange(state.age, std::nullopt);
      std::shared_ptr<ShownFrame> frame;
      {
        const std::scoped_lock lock(files_mutex_);
        frame = MakeShown(tracked, &state);
      }
      if (age) frame->taken = PlayClock().Now() - *age;
      {
        const std::scoped_lock lock(files_mutex_);
        CameraTally& tally = tallies_[static_cast<std::size_t>(tracked.frame.camera)];
        tally.Add(tracked);
        if (age) tally.AddTrackedAge(*age);
        files_->Add(*frame);
        const std::vector<Event> events = session_.TakeEvents();
        files_->Add(events);
        Warn(events);
        if (request_.on_frame) request_.on_frame(*frame);
      }
      for (const auto& head : heads_) head->AddView(tracked);
      if (tracked.frame.camera == 0) Direct(frame);
      if (tracked.state != engine::TrackingState::kDropped) state.last = frame;
      show(std::move(frame));
    };
    return run;
  }

  bool has_author_window() const { return request_.may_write && !request_.headless; }

  // Warnings stay in the author's window until they are dismissed.
  void Warn(const std::vector<Event>& events) {
    if (!has_author_window()) return;
    for (const Event& event : events) {
      if (event.event != "warning") continue;
      warnings_.insert(event.detail);
      notices_.Push({SentenceOf(event.detail), std::nullopt});
    }
  }

  void Direct(const std::shared_ptr<const ShownFrame>& frame) {
    if (!request_.director) return;
    const std::shared_ptr<const engine::TrackedFrame> tracked(frame, &frame->tracked);
    for (Command& command : request_.director(*frame)) inboxes_[0].Push({std::move(command), tracked});
  }

  // The sounds that are near the first camera, and their captions. With files_mutex_ held.
  void PlaySounds(ShownFrame* frame) {
    const engine::TrackedFrame& tracked = frame->tracked;
    std::optional<Eigen::Vector3d> place;
    if (engine::HasPose(tracked.state)) place = tracked.camera_from_map.OriginInSource();
    static const content::Scene kNoScene;
    const auto orders = sound_director_.Update(frame->seconds, tracked.map_key,
                                               frame->shown.scene ? *frame->shown.scene : kNoScene, place);
    frame->caption = orders.caption;
    for (const auto& [key, asset] : orders.start)
      files_->Add({Event{tracked.frame.time, "sound", "'" + key.second + "' begins"}});
    if (!sound_player_) return;
    sound_player_->Give(orders);
    const std::string problem = sound_player_->TakeProblem();
    if (problem.empty()) return;
    const std::vector<Event> events = {Event{tracked.frame.time, "warning", problem}};
    files_->Add(events);
    Warn(events);
  }

  std::shared_ptr<ShownFrame> MakeShown(const engine::TrackedFrame& tracked, CameraState* state) {
    auto frame = std::make_shared<ShownFrame>();
    frame->tracked = tracked;
    frame->shown = session_.ShownWith(tracked);
    const auto lens = session_.EstimatedLensOf(static_cast<std::size_t>(tracked.frame.camera));
    if (lens) frame->camera = lens->model;
    if (!state->first_time) state->first_time = tracked.frame.time;
    frame->seconds = ToSeconds(tracked.frame.time - *state->first_time);
    frame->message = state->message;
    // What the window shows as a warning already is not shown twice.
    if (state->message.empty() && !warnings_.contains(frame->shown.advice))
      frame->message = frame->shown.advice;
    if (state->visit) GuideVisitor(frame, state);
    if (tracked.frame.camera == 0) PlaySounds(frame.get());
    return frame;
  }

  static void GuideVisitor(const std::shared_ptr<ShownFrame>& frame, CameraState* state) {
    const bool has_pose = engine::HasPose(frame->tracked.state);
    frame->visitor = state->visit->Update(frame->seconds, has_pose ? frame->shown.map_name : std::string(),
                                          frame->shown.hint);
    if (has_pose) {
      state->last_with_pose = frame;
    } else if (state->last_with_pose && state->visit->HoldsContent(frame->seconds)) {
      frame->held_camera_from_map = state->last_with_pose->tracked.camera_from_map;
      frame->shown.scene = state->last_with_pose->shown.scene;
    } else {
      state->last_with_pose.reset();
    }
  }

  const GuideRequest& request_;
  const std::span<CalibratedCamera> cameras_;
  Session session_;
  std::vector<CommandInbox> inboxes_;  // By camera, like camera_states_.
  std::vector<CameraState> camera_states_;
  SoundDirector sound_director_;                     // Used for the frames of the first camera.
  std::optional<SoundPlayer> sound_player_;          // Only if sounds are to be heard.
  std::vector<std::unique_ptr<HeadControl>> heads_;  // Of the cameras that have a pan-tilt head.
  std::stop_source stop_;
  NoticeQueue notices_;
  std::mutex files_mutex_;            // Guards files_, tallies_ and warnings_.
  std::set<std::string> warnings_;    // Those that the window was told of.
  std::vector<CameraTally> tallies_;  // By camera.
  std::optional<GuideFiles> files_;
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
        if (view && view->Add(*frame, *cameras.front().model, inset.get())) run->Drawn(*frame);
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
    link.discard_changes = [run] { run->DiscardChanges(); };
    link.drawn = [run](const ShownFrame& frame) { run->Drawn(frame); };
    ShowInWindow(request, cameras, &slot, link);
  } catch (...) {
    fault = std::current_exception();
  }
  worker.RequestStop();
  if (fault) {
    // The window's error came first. The camera thread still saves its results before that error is thrown.
    try {
      worker.Join();
    } catch (const Error&) {
    }
    std::rethrow_exception(fault);
  }
  worker.Join();
}

}  // namespace

std::vector<Session::MapState> RunGuide(const GuideRequest& request, std::span<CalibratedCamera> cameras,
                                        Verbosity verbosity) {
  const Interruption interruption;
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
  options.lock_controls_after = 30;  // One second at 30 images/s, after which automatic exposure has settled.
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
