// SPDX-License-Identifier: Apache-2.0
#include "app/session/session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "app/files/image_files.h"
#include "app/output/engine_text.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

engine::SystemOptions SystemOptionsOf(const SessionOptions& options, MapKeys* keys) {
  engine::SystemOptions system = options;
  system.extend_maps = options.may_write;
  system.new_map_key = [keys] { return keys->TryTake(); };
  if (!system.mapper.images) system.mapper.images = std::make_shared<ImageFiles>();
  return system;
}

}  // namespace

Session::Session(const SessionOptions& options,
                 std::vector<std::shared_ptr<const engine::CameraModel>> cameras, maps::Library* library)
    : options_(options),
      library_(library),
      keys_(options.may_write ? library : nullptr),
      system_(SystemOptionsOf(options, &keys_), cameras) {
  for (auto& model : cameras) {
    Camera camera;
    camera.model = std::move(model);
    cameras_.push_back(std::move(camera));
  }
  system_.SetEventHook([this] {
    const std::scoped_lock lock(mutex_);
    HandleSystemEvents();
  });
  if (library_ != nullptr) {
    LoadMaps();
    if (options.may_write) StartSaver();
  }
  if (!options.first_map.empty()) {
    const std::scoped_lock lock(mutex_);
    Apply(NewMap{options.first_map}, engine::TrackedFrame());
  }
}

Session::~Session() {
  try {
    Finish();
  } catch (const std::exception& error) {
    // Callers that need the error call Finish before.
    spdlog::error("{}", error.what());
  }
}

void Session::AddEvent(Timestamp time, std::string event, std::string detail) {
  events_.push_back({time, std::move(event), std::move(detail)});
}

Timestamp Session::LastTime() const {
  Timestamp time{};
  for (const Camera& camera : cameras_) time = std::max(time, camera.last_time);
  return time;
}

engine::TrackedFrame Session::Process(const engine::Frame& frame) {
  engine::TrackedFrame tracked = system_.Process(frame);
  const std::scoped_lock lock(mutex_);
  Camera& camera = cameras_[static_cast<std::size_t>(frame.camera)];
  camera.last_time = frame.time;
  HandleSystemEvents();
  ReportRejection(&camera, tracked);
  if (options_.may_write) Autosave(frame.time);
  return tracked;
}

void Session::ReportRejection(Camera* camera, const engine::TrackedFrame& frame) {
  const auto name = [this](std::uint64_t key) { return NameOf(key); };
  const bool is_new = camera->relocalization_message.Update(frame.frame.time, engine::HasPose(frame.state),
                                                            frame.relocalization, name);
  const std::string& text = camera->relocalization_message.text();
  if (text.empty() || !is_new) return;
  AddEvent(frame.frame.time, "not sure",
           CameraPrefix(static_cast<std::size_t>(frame.frame.camera)) + text + " (" +
               std::to_string(frame.relocalization.inliers) + " inliers)");
}

void Session::Advise(Camera* camera, const std::string& sentence) {
  constexpr Timestamp kShown = std::chrono::seconds(15);
  camera->advice = sentence;
  camera->advice_end = camera->last_time + kShown;
}

Session::Shown Session::ShownWith(const engine::TrackedFrame& frame) const {
  const std::uint64_t active = system_.ActiveMap();
  const std::uint64_t current = CurrentMap(frame);
  const std::scoped_lock lock(mutex_);
  Shown shown;
  if (frame.state == engine::TrackingState::kInitializing) shown.starting_map = NameOf(current);
  const Camera& camera = cameras_.at(static_cast<std::size_t>(frame.frame.camera));
  if (frame.frame.time < camera.advice_end) shown.advice = camera.advice;
  const std::string& rejection = camera.relocalization_message.text();
  shown.hint = rejection.empty() ? TextOf(frame.hint) : rejection;
  if (options_.may_write) shown.mapping = MappingStatusOf(frame, active != 0 && active == frame.map_key);
  const auto found = maps_.find(frame.map_key);
  if (found == maps_.end()) return shown;
  shown.map_name = found->second.name;
  shown.scene = found->second.scene;
  return shown;
}

std::vector<Session::MapState> Session::Maps() const {
  const std::scoped_lock lock(mutex_);
  std::vector<MapState> states;
  for (const auto& [key, map] : maps_) {
    states.push_back(
        {key, map.name, map.policy, map.snapshot, map.scene, map.in_library, map.discarded, map.joined_into});
  }
  return states;
}

std::vector<Event> Session::TakeEvents() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(events_, {});
}

Session::Saving Session::SavingNow() const {
  Saving saving;
  if (!saver_) return saving;
  saving.unsaved = saver_->pending() > 0;
  const std::scoped_lock lock(mutex_);
  saving.saved_at = saved_at_;
  for (const auto& [key, map] : maps_)
    saving.unsaved = saving.unsaved || (map.Exists() && map.NeedsSave() && map.snapshot->HasFinitePoints());
  return saving;
}

void Session::DiscardChanges() {
  const std::scoped_lock lock(mutex_);
  discards_changes_ = true;
}

void Session::Finish() {
  if (std::exchange(finished_, true)) return;
  std::exception_ptr failure;
  try {
    system_.Finish();
  } catch (...) {
    failure = std::current_exception();  // what was mapped before is saved all the same
  }
  if (saver_) {
    saver_->EndMaintenance();
    saver_->Flush();  // so that failed saves are repeated below
    {
      const std::scoped_lock lock(mutex_);
      HandleSystemEvents();
      const Timestamp time = LastTime();
      ReportSaveFailure(time);
      for (auto& [key, map] : maps_) SaveMap(&map, time);
    }
    saver_->Flush();
    if (!failure) failure = saver_->TakeError();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace docent::app
