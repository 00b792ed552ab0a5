// SPDX-License-Identifier: Apache-2.0
#include "app/session/session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <variant>

#include "app/files/image_files.h"
#include "app/output/engine_text.h"
#include "app/script/format_command.h"
#include "app/session/entrance_view.h"
#include "engine/base/error.h"
#include "engine/vision/small_blurry_image.h"

namespace docent::app {

namespace {

engine::SystemOptions SystemOptionsOf(const SessionOptions& options, MapKeys* keys) {
  engine::SystemOptions system = options;
  system.extend_maps = options.may_write;
  system.new_map_key = [keys] { return keys->TryTake(); };
  if (!system.mapper.images) system.mapper.images = std::make_shared<ImageFiles>();
  return system;
}

// The error, with one more sentence at its end.
std::exception_ptr WithSentence(const std::exception_ptr& failure, const std::string& sentence) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    const std::string what = error.what();
    return std::make_exception_ptr(Error(what + (what.ends_with('.') ? " " : ". ") + sentence));
  } catch (...) {
    return failure;
  }
}

}  // namespace

Session::Session(const SessionOptions& options,
                 std::vector<std::shared_ptr<const engine::CameraModel>> cameras, maps::Library* library)
    : options_(options),
      keys_(options.may_write ? library : nullptr),
      system_(SystemOptionsOf(options, &keys_), cameras),
      state_(std::move(cameras)),
      event_handler_(options_, &system_, &state_, &memory_, &saving_),
      map_commands_(library, &keys_, &system_, &state_, &event_handler_, &memory_, &saving_),
      content_commands_(options_, &system_, &state_, &assets_),
      memory_(options_, library, &system_, &mutex_, &state_, &assets_),
      saving_(options_, library, &keys_, &system_, &mutex_, &state_) {
  system_.SetEventHook([this] {
    const std::scoped_lock lock(mutex_);
    event_handler_.HandleEvents();
  });
  if (library != nullptr) {
    memory_.Open();
    if (options.may_write) saving_.Start();
  }
  if (!options.first_map.empty()) {
    const std::scoped_lock lock(mutex_);
    map_commands_.Apply(NewMap{options.first_map}, engine::TrackedFrame());
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

engine::TrackedFrame Session::Process(const engine::Frame& frame) {
  engine::TrackedFrame tracked = system_.Process(frame);
  const std::scoped_lock lock(mutex_);
  state_.cameras[static_cast<std::size_t>(frame.camera)].last_time = frame.time;
  event_handler_.HandleEvents();
  event_handler_.ReportRejection(tracked);
  if (options_.may_write) saving_.Autosave(frame.time);
  return tracked;
}

void Session::Idle(Timestamp time) {
  const std::scoped_lock lock(mutex_);
  event_handler_.HandleEvents();
  for (SessionCamera& camera : state_.cameras) {
    if (camera.advice_end <= time) camera.advice.clear();
  }
  if (options_.may_write) saving_.Autosave(time);
}

void Session::Execute(const Command& command, const engine::TrackedFrame& frame,
                      const std::filesystem::path& model_folder) {
  if (std::holds_alternative<GuideVisitor>(command)) throw Error("there is no visitor; use docent tour");
  if (!options_.may_write && !std::holds_alternative<UseMap>(command)) {
    throw Error("a tour is read-only; use docent author to make changes");
  }
  if (const std::string problem = Validate(command); !problem.empty()) throw Error(problem);
  memory_.LoadFor(command);
  Preload(command, model_folder);
  std::unique_lock lock(mutex_);
  event_handler_.HandleEvents();
  assets_.SetFolder(model_folder);
  const auto apply = [&](const auto& chosen) {
    if constexpr (requires { map_commands_.Apply(chosen, frame, &lock); }) {
      map_commands_.Apply(chosen, frame, &lock);  // waits for the disk
    } else if constexpr (requires { map_commands_.Apply(chosen, frame); }) {
      map_commands_.Apply(chosen, frame);
    } else if constexpr (requires { content_commands_.Apply(chosen, frame); }) {
      content_commands_.Apply(chosen, frame);
    }
  };
  std::visit(apply, command);
  event_handler_.HandleEvents();
  state_.AddEvent(frame.frame.time, "command", FormatCommand(command));
}

bool Session::MustRead(const Command& command, const std::filesystem::path& model_folder) {
  const std::optional<AssetFile> file = FileOf(command);
  if (!file) return false;
  const std::scoped_lock lock(mutex_);
  assets_.SetFolder(model_folder);
  return !assets_.Find(file->name, file->kind);
}

void Session::Preload(const Command& command, const std::filesystem::path& model_folder) {
  if (!MustRead(command, model_folder)) return;
  const std::optional<AssetFile> file = FileOf(command);
  SessionAssets::Decoded decoded = SessionAssets::Decode(model_folder, file->name, file->kind);
  const std::scoped_lock lock(mutex_);
  assets_.SetFolder(model_folder);
  assets_.Keep(file->name, file->kind, std::move(decoded));
}

void Session::ReloadContent(const std::vector<std::uint64_t>& keys) {
  for (const std::uint64_t key : keys) {
    try {
      if (const std::optional<std::string> name = memory_.ReloadContent(key))
        AddEvent("hub", "the content of '" + *name + "' was updated");
    } catch (const Error& error) {
      // A map that was removed stays until the session ends.
      AddEvent("warning", error.what());
    }
  }
}

void Session::AddEvent(const std::string& event, const std::string& sentence) {
  const std::scoped_lock lock(mutex_);
  state_.AddEvent(state_.LastTime(), event, sentence);
}

Session::Shown Session::ShownWith(const engine::TrackedFrame& frame) const {
  const std::uint64_t active = system_.ActiveMap();
  const std::uint64_t current = system_.CurrentMap(CameraOf(frame));
  const std::scoped_lock lock(mutex_);
  Shown shown;
  if (frame.state == engine::TrackingState::kInitializing) shown.starting_map = state_.NameOf(current);
  const SessionCamera& camera = state_.cameras.at(CameraOf(frame));
  if (frame.frame.time < camera.advice_end) shown.advice = camera.advice;
  shown.rejection = camera.relocalization_message.rejection();
  const std::string& rejection = camera.relocalization_message.text();
  shown.hint = rejection.empty() ? TextOf(frame.hint) : rejection;
  if (options_.may_write) shown.mapping = MappingStatusOf(frame, active != 0 && active == frame.map_key);
  const auto found = state_.maps.find(frame.map_key);
  if (found == state_.maps.end()) return shown;
  shown.map_name = found->second.name;
  shown.scene = found->second.scene;
  if (found->second.policy == maps::Policy::kBounded) shown.bounds = found->second.bounds;
  // The pointer to the triangles keeps the whole mesh alive.
  const std::shared_ptr<const engine::MapMesh>& mesh = found->second.mesh;
  shown.room_light = options_.room_light;
  if (options_.room_light) shown.light = found->second.light;
  shown.occluders = options_.occlusion != Occlusion::kOff;
  if (options_.occlusion == Occlusion::kMap && mesh) shown.surfaces = {mesh, &mesh->mesh};
  return shown;
}

std::shared_ptr<const content::Scene> Session::SceneOf(std::uint64_t map_key) const {
  const std::scoped_lock lock(mutex_);
  const auto found = state_.maps.find(map_key);
  if (found == state_.maps.end() || !found->second.Exists() || !found->second.snapshot) return nullptr;
  return found->second.scene;
}

std::vector<Session::SimilarView> Session::SimilarViews(const engine::Frame& frame, std::size_t count,
                                                        bool entrances) {
  cv::Mat gray = frame.image;
  if (gray.channels() == 3) cv::cvtColor(frame.image, gray, cv::COLOR_BGR2GRAY);
  if (gray.empty()) return {};
  const engine::SmallBlurryImage thumbnail = engine::MakeSmallBlurryImage(gray);
  // Candidates of maps that are not in memory are left out, so more are asked for.
  const int asked = 4 * static_cast<int>(count);
  std::vector<SimilarView> views;
  for (const auto& place : system_.place_index().FindPlaces(thumbnail, asked, 1, 0)) {
    if (views.size() >= count) break;
    if (!place.map) continue;
    const std::scoped_lock lock(mutex_);
    const engine::KeyFrame* keyframe = place.map->FindKeyFrame(place.keyframe);
    const SessionMap* const map = state_.FindMap(place.map_key);
    if (entrances && map != nullptr && map->scene) keyframe = EntranceOf(*place.map, map->scene->settings);
    if (keyframe == nullptr) continue;
    keyframe->features->MarkInUse();
    views.push_back({state_.NameOf(place.map_key), keyframe->features->levels[1].clone()});
  }
  return views;
}

std::vector<Session::MapState> Session::Maps() const {
  const std::scoped_lock lock(mutex_);
  std::vector<MapState> states;
  for (const auto& [key, map] : state_.maps) {
    states.push_back(
        {key, map.name, map.policy, map.snapshot, map.scene, map.in_library, map.discarded, map.joined_into});
  }
  return states;
}

std::vector<Event> Session::TakeEvents() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(state_.events, {});
}

void Session::DiscardChanges() {
  const std::scoped_lock lock(mutex_);
  saving_.DiscardChanges();
}

void Session::Finish() {
  if (std::exchange(finished_, true)) return;
  std::exception_ptr failure;
  try {
    system_.Finish();
  } catch (...) {
    failure = std::current_exception();  // what was mapped before is saved all the same
  }
  if (saving_.HasStarted()) {
    saving_.EndMaintenance();
    saving_.Flush();  // so that failed saves are repeated below
    {
      const std::scoped_lock lock(mutex_);
      event_handler_.HandleEvents();
      const Timestamp time = state_.LastTime();
      saving_.ReportFailure(time);
      saving_.SaveAll(time);
    }
    saving_.Flush();
    if (!failure) failure = saving_.TakeError();
    if (const std::string lost = saving_.DescribeUnsaved(); !lost.empty())
      failure = failure ? WithSentence(failure, lost) : std::make_exception_ptr(Error(lost));
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace docent::app
