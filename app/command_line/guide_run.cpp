// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_run.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <exception>
#include <functional>
#include <utility>

#include "app/command_line/command_words.h"
#include "app/command_line/interruption.h"
#include "app/files/text_file.h"
#include "app/output/engine_text.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

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

std::vector<std::string> NamesOf(std::span<const CalibratedCamera> cameras) {
  std::vector<std::string> names;
  for (const CalibratedCamera& camera : cameras) names.push_back(camera.source->info().name);
  return names;
}

std::vector<std::shared_ptr<const engine::CameraModel>> ModelsOf(std::span<CalibratedCamera> cameras) {
  std::vector<std::shared_ptr<const engine::CameraModel>> models;
  for (const CalibratedCamera& camera : cameras) models.push_back(camera.model);
  return models;
}

constexpr double kRefusalShown_s = 5;  // Long enough to read why a step is not possible.

SessionOptions SessionOptionsOf(const GuideRequest& request, std::span<CalibratedCamera> cameras) {
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
  options.occlusion = request.occlusion;
  options.room_light = request.room_light;
  options.tracker.target = request.target;
  options.mapper.lens.lenses = EstimatedLensesOf(cameras);
  return options;
}

SessionOptions WithSaved(SessionOptions options, std::function<void()> on_saved) {
  options.on_saved = std::move(on_saved);
  return options;
}

bool AllRecorded(std::span<const CalibratedCamera> cameras) {
  return std::none_of(cameras.begin(), cameras.end(),
                      [](const CalibratedCamera& camera) { return camera.source->info().live; });
}

// Whether a person would see no difference.
bool LooksEqual(const ShownFrame& a, const ShownFrame& b) {
  return a.shown.scene == b.shown.scene && a.shown.surfaces == b.shown.surfaces &&
         a.shown.light == b.shown.light && a.shown.map_name == b.shown.map_name &&
         a.shown.starting_map == b.shown.starting_map && a.shown.hint == b.shown.hint &&
         a.shown.mapping == b.shown.mapping && a.message == b.message && a.caption == b.caption;
}

constexpr const char* kPaused = "The recording is paused. Start a map or press Space to continue.";
constexpr const char* kEnded =
    "The recording has ended. Its last image stays, and you can still place content in it.";

}  // namespace

GuideRun::GuideRun(const GuideRequest& request, std::span<CalibratedCamera> cameras)
    : request_(request),
      cameras_(cameras),
      is_paced_(request.stays_at_last && AllRecorded(cameras)),
      clock_(is_paced_ && request.waits_at_first),
      hub_(request.hub, request.may_write),
      session_(WithSaved(SessionOptionsOf(request, cameras), [this] { hub_.LibraryWasSaved(); }),
               ModelsOf(cameras), request.library),
      inboxes_(cameras.size()),
      camera_states_(cameras.size()),
      sounds_(request),
      visitor_frames_(cameras.size()),
      watch_(NamesOf(cameras), VisitorStringsFor(request.may_write ? "en" : request.language)) {
  if (!request.may_write)
    host_.emplace(request, &session_, cameras.size(), [this](const Event& event) {
      files_->Add({event});
      Warn({event});
    });
  for (const CalibratedCamera& camera : cameras) tallies_.emplace_back(camera.source->info().name);
  if (!request.head) return;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (Head* const head = cameras[i].source->head())
      heads_.push_back(
          std::make_unique<HeadControl>(head, static_cast<int>(i), cameras[i].model, *request.head));
  }
  if (heads_.empty()) throw Error("No camera has a pan-tilt head; remove --head.");
}

void GuideRun::Run(const Show& show, std::stop_token window_closed) {
  files_.emplace(request_, *cameras_.front().model);
  const std::stop_callback forward(window_closed, [this] { stop_.request_stop(); });
  WarnAboutUnknownLenses();
  std::exception_ptr fault;
  const auto guarded = [&fault](const auto& action) {
    try {
      action();
    } catch (const std::exception& error) {
      // It may say which maps are lost.
      if (fault) spdlog::error("{}", error.what());
      if (!fault) fault = std::current_exception();
    }
  };
  guarded([&] {
    hub_.Begin(&session_);
    std::vector<CameraRun> runs;
    for (std::size_t i = 0; i < cameras_.size(); ++i) runs.push_back(RunOf(i, show));
    RunCameras(runs, &session_, stop_.get_token());
  });
  hub_.StopFollowing();
  {
    const std::scoped_lock lock(files_mutex_);
    visitor_frames_.Clear();
  }
  guarded([&] { session_.Finish(); });
  guarded([&] { hub_.FinishPushing(); });
  // With a failure, a kiosk that its staff has ended would start again.
  const auto guarded_record = [&](const auto& action) {
    guarded([&] {
      try {
        action();
      } catch (const Error& error) {
        if (request_.kiosk_code.empty()) throw;
        spdlog::error("{}", error.what());
      }
    });
  };
  guarded_record([&] {
    const std::vector<Event> events = session_.TakeEvents();
    files_->Add(events);
    Warn(events);
    WriteDelivery();
    files_->Close();
  });
  guarded_record([&] {
    if (host_) host_->Finish();
  });
  guarded([&] {
    const std::scoped_lock lock(files_mutex_);
    if (request_.output)
      WriteCameraReport(*request_.output / "report.json", tallies_,
                        session_.MappingTimes().max_queue_latency);
  });
  if (fault) std::rethrow_exception(fault);
}

// The images that live cameras delivered and missed, for the report and as events.
void GuideRun::WriteDelivery() {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const FrameSource& source = *cameras_[i].source;
    if (source.info().live) tallies_[i].SetDelivery(source.delivery());
    if (source.info().live && camera_states_[i].last)
      files_->Add({Event{camera_states_[i].last->tracked.frame.time, "camera",
                         DeliveryText(source.info(), source.delivery())}});
  }
}

void GuideRun::Reached(FrameStage stage, const ShownFrame& frame) {
  const Timestamp now = PlayClock().Now();
  const std::scoped_lock lock(files_mutex_);
  CameraTally& tally = tallies_[static_cast<std::size_t>(frame.tracked.frame.camera)];
  if (frame.taken) tally.AddAge(stage, now - *frame.taken);
  if (stage != FrameStage::kShown) return;
  tally.AddShown(now);
  if (frame.tracked.frame.camera == 0) sounds_.HandleShown(frame.tracked.frame.index);
}

std::shared_ptr<const ShownFrame> GuideRun::Lead(std::size_t camera, const GuideVisitor& guide) {
  const std::scoped_lock lock(files_mutex_);
  std::shared_ptr<ShownFrame> frame = visitor_frames_.CopyOfLast(camera);
  if (!frame) return nullptr;
  std::string refusal;
  try {
    host_->Lead(guide, frame->tracked);
  } catch (const Error& error) {
    refusal = SentenceOf(error.what());
  }
  visitor_frames_.Answer(refusal, frame.get());
  host_->GuideAgain(camera, frame->camera ? *frame->camera : *cameras_[camera].model, frame);
  frame->serial = ++serial_;
  visitor_frames_.SetLast(frame);
  return visitor_frames_.OverNewest(std::move(frame));
}

void GuideRun::Used() {
  const std::scoped_lock lock(files_mutex_);
  if (host_) host_->Use();
}

void GuideRun::HandleUntracked(const engine::Frame& image, const Show& show) {
  std::shared_ptr<ShownFrame> frame;
  {
    const std::scoped_lock lock(files_mutex_);
    frame = visitor_frames_.Over(image);
    if (!frame) return;
    frame->serial = ++serial_;
  }
  show(std::move(frame));
}

void GuideRun::TakeAnswer(const ShownFrame& frame, CameraState* state) {
  const std::optional<std::string> refusal = visitor_frames_.TakeAnswer(CameraOf(frame.tracked));
  if (!refusal) return;
  if (!refusal->empty()) {
    state->message = *refusal;
    state->message_end_s = frame.seconds + kRefusalShown_s;
  } else if (state->message_end_s) {
    // Only what is shown for a while was an answer.
    state->message.clear();
    state->message_end_s.reset();
  }
}

SavingState GuideRun::Saving() const {
  const Session::Saving saving = session_.SavingNow();
  return {saving.unsaved, saving.saved_at};
}

std::vector<ui::MapFacts> GuideRun::MapsForWindow() const {
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

// A tour builds no map, so it cannot estimate a calibration.
void GuideRun::WarnAboutUnknownLenses() {
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
    ReportProblem(warning, {});
    camera_states_[i].message = warning;
  }
}

CameraRun GuideRun::RunOf(std::size_t i, const Show& show) {
  CameraState& state = camera_states_[i];
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
  run.options.take = [this](const Command& command, const engine::TrackedFrame& frame) {
    const std::scoped_lock lock(files_mutex_);
    return host_ && host_->Lead(command, frame);
  };
  run.options.refused = [this, &state](const std::string& reason) { HandleRefused(reason, &state); };
  run.options.reading = [this](const std::string& file) {
    if (has_author_window()) notices_.Push({"", std::nullopt, ReadingText(file)});
  };
  run.options.carried_out = [this, i, &state](const TimedCommand& command) {
    HandleCarriedOut(command, i, &state);
  };
  run.options.trouble = [this, &state, &show](const std::string& sentence, Timestamp time) {
    HandleTrouble(sentence, time, show, &state);
  };
  run.options.disconnected = [this, &state, &show](const engine::TrackedFrame* last) {
    HandleDisconnected(last, show, &state);
  };
  // What is recorded has the images in their order.
  if (host_ && !request_.headless && !request_.record && !request_.on_image)
    run.options.untracked = [this, &show](const engine::Frame& image) { HandleUntracked(image, show); };
  // Visitors who watch a recording act in it.
  run.options.no_faster_than_times = !request_.may_write && !request_.headless;
  run.options.latency = [&state](Timestamp age) { state.age = age; };
  if (AllRecorded(cameras_)) run.options.clock = &clock_;
  if (is_paced_) {
    run.options.stays = true;
    run.options.idle = [this, &state, &show](const engine::TrackedFrame& tracked, bool at_end) {
      HandleIdle(tracked, at_end, show, &state);
    };
  }
  run.shown = [this, &state, &show](const engine::TrackedFrame& tracked) {
    if (tracked.map_key != 0) hub_.Visit(tracked.map_key);
    HandleFrame(tracked, show, &state);
  };
  return run;
}

void GuideRun::TogglePause() {
  if (!is_paced_) return;
  if (clock_.IsStopped()) {
    clock_.Resume();
  } else {
    clock_.Stop();
  }
}

void GuideRun::ToggleFastForward() {
  if (!AllRecorded(cameras_)) return;
  clock_.SetFastForward(!clock_.IsFastForward());
}

void GuideRun::HandleRefused(const std::string& reason, CameraState* state) {
  if (has_author_window()) {
    notices_.Push({SentenceOf(reason), std::nullopt});
  } else {
    state->message = SentenceOf(reason);
    if (state->last) state->message_end_s = state->last->seconds + kRefusalShown_s;
  }
}

void GuideRun::HandleCarriedOut(const TimedCommand& command, std::size_t camera, CameraState* state) {
  if (has_author_window()) {
    notices_.Push({"", command.command});
  } else {
    state->message.clear();
  }
  // What comes before a map is started would be lost to it.
  const bool begins =
      std::holds_alternative<NewMap>(command.command) || std::holds_alternative<UseMap>(command.command);
  if (begins) clock_.Resume();
  const std::scoped_lock lock(files_mutex_);
  files_->Add(command, camera);
}

void GuideRun::HandleTrouble(const std::string& sentence, Timestamp time, const Show& show,
                             CameraState* state) {
  state->message = sentence;
  state->message_end_s.reset();
  {
    const std::scoped_lock lock(files_mutex_);
    files_->Add({Event{time, "camera", sentence.empty() ? "The camera is back." : sentence}});
  }
  if (!state->last) return;
  // There is no new image, so the last one is shown again with the message.
  auto frame = std::make_shared<ShownFrame>(*state->last);
  frame->message = sentence;
  {
    const std::scoped_lock lock(files_mutex_);
    frame->serial = ++serial_;
    if (host_) {
      visitor_frames_.SetTrouble(CameraOf(frame->tracked), sentence);
      visitor_frames_.SetLast(frame);
    }
  }
  show(std::move(frame));
}

void GuideRun::Watch(const engine::TrackedFrame& tracked) {
  RunWatch::Notices notices = watch_.Add(tracked);
  files_->Add(notices.events);
  Warn(notices.events);
  // An author has the warning.
  if (!has_author_window() && !notices.sentence.empty()) noticed_ = std::move(notices.sentence);
}

void GuideRun::HandleFrame(const engine::TrackedFrame& tracked, const Show& show, CameraState* state) {
  if (Interruption::requested()) stop_.request_stop();
  const std::optional<Timestamp> age = std::exchange(state->age, std::nullopt);
  std::shared_ptr<ShownFrame> frame;
  {
    const std::scoped_lock lock(files_mutex_);
    frame = MakeShown(tracked, state);
    if (age) frame->taken = PlayClock().Now() - *age;
    if (host_ && tracked.state != engine::TrackingState::kDropped) visitor_frames_.SetLast(frame);
    // Content is seen on its own image, even if that is older.
    if (engine::HasPose(tracked.state)) visitor_frames_.ForgetUntracked(CameraOf(tracked));
  }
  {
    const std::scoped_lock lock(files_mutex_);
    CameraTally& tally = tallies_[static_cast<std::size_t>(tracked.frame.camera)];
    tally.Add(tracked);
    Watch(tracked);
    if (age) tally.AddAge(FrameStage::kTracked, *age);
    files_->Add(*frame);
    const std::vector<Event> events = session_.TakeEvents();
    files_->Add(events);
    Warn(events);
    ReportProblem(files_->TakeProblem(), tracked.frame.time);
    if (request_.on_frame) request_.on_frame(*frame, session_.MappingTimes());
  }
  for (const auto& head : heads_) head->AddView(tracked);
  if (tracked.frame.camera == 0) Direct(frame);
  if (tracked.state != engine::TrackingState::kDropped) state->last = frame;
  std::shared_ptr<const ShownFrame> over;
  {
    const std::scoped_lock lock(files_mutex_);
    over = visitor_frames_.OverNewest(std::move(frame));
  }
  show(std::move(over));
}

void GuideRun::HandleIdle(const engine::TrackedFrame& tracked, bool at_end, const Show& show,
                          CameraState* state) {
  if (Interruption::requested()) stop_.request_stop();
  if (at_end && !std::exchange(state->has_ended, true)) {
    const std::scoped_lock lock(files_mutex_);
    files_->Add({Event{tracked.frame.time, "camera", "The images have ended; the last one stays."}});
  }
  ShowAgain(tracked, at_end ? kEnded : kPaused, show, state);
}

void GuideRun::HandleDisconnected(const engine::TrackedFrame* last, const Show& show, CameraState* state) {
  if (Interruption::requested()) stop_.request_stop();
  // Only an author changes content meanwhile.
  if (last != nullptr && has_author_window()) ShowAgain(*last, "", show, state);
}

void GuideRun::ShowAgain(const engine::TrackedFrame& tracked, const std::string& message, const Show& show,
                         CameraState* state) {
  std::shared_ptr<ShownFrame> frame;
  {
    const std::scoped_lock lock(files_mutex_);
    frame = MakeShown(tracked, state);
    if (frame->message.empty()) frame->message = message;
    const std::vector<Event> events = session_.TakeEvents();
    files_->Add(events);
    Warn(events);
  }
  if (state->last && LooksEqual(*frame, *state->last)) return;
  state->last = frame;
  show(std::move(frame));
}

// Warnings stay in the author's window until they are dismissed. Those of a tour are not for its visitors,
// and without --output the log alone has them.
void GuideRun::Warn(const std::vector<Event>& events) {
  for (const Event& event : events) {
    if (event.event != "warning") continue;
    if (has_author_window()) {
      warnings_.insert(event.detail);
      notices_.Push({SentenceOf(event.detail), std::nullopt});
    } else if (!request_.may_write && logged_.insert(event.detail).second) {
      spdlog::warn("{}", SentenceOf(event.detail));
    }
  }
}

void GuideRun::Direct(const std::shared_ptr<const ShownFrame>& frame) {
  if (!request_.director) return;
  const std::shared_ptr<const engine::TrackedFrame> tracked(frame, &frame->tracked);
  for (Command& command : request_.director(*frame)) inboxes_[0].Push({std::move(command), tracked});
}

void GuideRun::PlaySounds(ShownFrame* frame) {
  const std::vector<SoundDirector::Key> asked =
      host_ ? host_->TakeAskedSounds() : std::vector<SoundDirector::Key>();
  files_->Add(sounds_.Add(frame, asked));
  ReportProblem(sounds_.TakeProblem(), frame->tracked.frame.time);
}

void GuideRun::ReportProblem(const std::string& problem, Timestamp time) {
  if (problem.empty()) return;
  const std::vector<Event> events = {Event{time, "warning", problem}};
  files_->Add(events);
  Warn(events);
}

std::shared_ptr<ShownFrame> GuideRun::MakeShown(const engine::TrackedFrame& tracked, CameraState* state) {
  auto frame = std::make_shared<ShownFrame>();
  frame->tracked = tracked;
  frame->serial = ++serial_;
  frame->shown = session_.ShownWith(tracked);
  const auto lens = session_.EstimatedLensOf(static_cast<std::size_t>(tracked.frame.camera));
  if (lens) frame->camera = lens->model;
  if (!state->first_time) state->first_time = tracked.frame.time;
  frame->seconds = ToSeconds(tracked.frame.time - *state->first_time);
  TakeAnswer(*frame, state);
  if (state->message_end_s && frame->seconds > *state->message_end_s) {
    state->message.clear();
    state->message_end_s.reset();
  }
  if (tracked.frame.camera == 0 && !noticed_.empty() && state->message.empty()) {
    constexpr double kShown_s = 8;  // Long enough to read two lines twice.
    state->message = std::exchange(noticed_, {});
    state->message_end_s = frame->seconds + kShown_s;
  }
  frame->message = state->message;
  // What the window shows as a warning already is not shown twice.
  if (state->message.empty() && !warnings_.contains(frame->shown.advice))
    frame->message = frame->shown.advice;
  const engine::CameraModel& camera = frame->camera ? *frame->camera : *cameras_[CameraOf(tracked)].model;
  if (host_) host_->Guide(CameraOf(tracked), camera, frame);
  if (tracked.frame.camera == 0) PlaySounds(frame.get());
  return frame;
}

}  // namespace docent::app
