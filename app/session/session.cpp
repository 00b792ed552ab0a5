// SPDX-License-Identifier: Apache-2.0
#include "app/session/session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

Session::Session(const SessionOptions& options,
                 std::vector<std::shared_ptr<const engine::CameraModel>> cameras, maps::Library* library)
    : options_(options),
      library_(library),
      association_(cameras.size()),
      mapping_(options.mapper, options.threaded && options.may_write,
               [this](const MappingThread::MapperUpdate& update) { OnMapperUpdate(update); }) {
  // Trackers and mapper use the processors; OpenCV's own threads would only compete with them.
  cv::setNumThreads(1);
  engine::TrackerOptions tracker_options = options.tracker;
  tracker_options.build_maps = options.may_write;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Camera camera;
    camera.tracker = std::make_unique<engine::Tracker>(tracker_options, cameras[i], options.seed + i);
    camera.calibration_monitor = std::make_unique<CalibrationMonitor>(cameras[i]);
    camera.model = std::move(cameras[i]);
    cameras_.push_back(std::move(camera));
  }
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

CameraPlaceFinder Session::ApplyOrder(std::size_t index, Timestamp time) {
  Camera* const camera = &cameras_[index];
  engine::Tracker& tracker = *camera->tracker;
  std::uint64_t searched = 0;
  std::optional<CameraPlaceFinder::Prediction> prediction;
  std::shared_ptr<const engine::MapSnapshot> snapshot;
  std::uint64_t key = 0;
  Camera::Order order = Camera::Order::kNone;
  {
    const std::scoped_lock lock(mutex_);
    order = std::exchange(camera->order, Camera::Order::kNone);
    if (order == Camera::Order::kStart || order == Camera::Order::kStartAfterLoss)
      camera->initializing = true;
    if (order == Camera::Order::kLeave || order == Camera::Order::kEnter) camera->initializing = false;
    if (const auto found = maps_.find(camera->map_key); found != maps_.end()) {
      snapshot = found->second.snapshot;
      key = camera->map_key;
    }
    // A map without finite points still waits for its initialization.
    if (snapshot && snapshot->HasFinitePoints()) camera->initializing = false;
    searched = association_.SearchedMap(index);
    if (snapshot && index < 2 && !association_.IsTracked(index)) {
      if (const auto pose = rig_.Predict(static_cast<int>(index), time, key))
        prediction = CameraPlaceFinder::Prediction{key, snapshot, *pose};
    }
  }
  if (order == Camera::Order::kStart) {
    tracker.StartNewMap(/*search_known_maps=*/false);
  } else if (order == Camera::Order::kStartAfterLoss) {
    tracker.StartNewMap(/*search_known_maps=*/true);
  } else if (order == Camera::Order::kStartAgain) {
    tracker.StartFailed();
  } else if (order != Camera::Order::kNone) {
    tracker.Reset();
  }
  tracker.SetMap(std::move(snapshot), key);
  const engine::PlaceFinder* const all = pager_ ? static_cast<const engine::PlaceFinder*>(&*pager_) : &index_;
  return CameraPlaceFinder(all, searched, std::move(prediction));
}

engine::TrackedFrame Session::Process(const engine::Frame& frame) {
  const auto index = static_cast<std::size_t>(frame.camera);
  Camera& camera = cameras_.at(index);
  const CameraPlaceFinder places = ApplyOrder(index, frame.time);
  engine::TrackedFrame tracked = camera.tracker->Track(frame, &places);
  HandleResult(index, &tracked);
  if (options_.may_write) {
    OfferToMapper(&camera, tracked);
    if (!options_.threaded) mapping_.RunLockstep();
    Autosave(frame.time);
  }
  return tracked;
}

void Session::HandleResult(std::size_t index, engine::TrackedFrame* frame) {
  const std::scoped_lock lock(mutex_);
  Camera* const camera = &cameras_[index];
  camera->last_time = frame->frame.time;
  if (!engine::HasPose(frame->state)) {
    association_.SetLost(index);
  } else if (const auto map = maps_.find(frame->map_key); camera->order != Camera::Order::kNone ||
                                                          map == maps_.end() || !map->second.Exists() ||
                                                          !association_.SetTracked(index, frame->map_key)) {
    association_.SetLost(index);
    RejectPose(camera, frame);
  }
  const bool has_pose = engine::HasPose(frame->state);
  ReportRejection(camera, frame);
  if (has_pose && frame->map_key != camera->map_key) {
    EnterMap(camera, frame->map_key, frame->frame.time);
  } else if (frame->state == engine::TrackingState::kRelocalized) {
    const std::string by = cameras_.size() > 1 ? " by camera " + std::to_string(index) : std::string();
    AddEvent(frame->frame.time, "relocalized", maps_[frame->map_key].name + by);
  }
  if (has_pose) {
    camera->lost_since.reset();
    CheckCalibration(index, *frame);
    UpdateRig(index, *frame);
  } else if (frame->state == engine::TrackingState::kLost && !camera->lost_since) {
    camera->lost_since = frame->frame.time;
  }
  // With several cameras, one that is tracked shows that the initialization holds.
  if (has_pose || !association_.AnyTracked()) CheckProvisionalMap(camera, *frame);
  if (!has_pose) CheckLoss(camera, *frame);
}

// Handles a pose in a map that the cameras are no longer in: while the frame was tracked, another camera
// relocalized elsewhere, or the user chose another map.
void Session::RejectPose(Camera* camera, engine::TrackedFrame* frame) {
  frame->state = engine::TrackingState::kLost;
  frame->quality_class = engine::TrackingQuality::kLost;
  frame->map.reset();
  frame->map_key = 0;
  frame->matches.clear();
  frame->finite_points = frame->infinite_points = 0;
  frame->hint = "Point this camera at what the other camera sees";
  camera->relocalization_message = {};
  if (camera->order == Camera::Order::kNone) camera->order = Camera::Order::kEnter;
}

void Session::ReportRejection(Camera* camera, engine::TrackedFrame* frame) {
  const auto name = [&](std::uint64_t key) {
    const auto found = maps_.find(key);
    return found != maps_.end() ? found->second.name : std::string();
  };
  const bool is_new = camera->relocalization_message.Update(frame->frame.time, engine::HasPose(frame->state),
                                                            frame->relocalization, name);
  const std::string& text = camera->relocalization_message.text();
  if (text.empty()) return;
  frame->hint = text;
  if (!is_new) return;
  const std::string by =
      cameras_.size() > 1 ? "camera " + std::to_string(frame->frame.camera) + ": " : std::string();
  AddEvent(frame->frame.time, "not sure",
           by + text + " (" + std::to_string(frame->relocalization.inliers) + " inliers)");
}

void Session::UpdateRig(std::size_t index, const engine::TrackedFrame& frame) {
  if (cameras_.size() < 2 || index > 1) return;
  rig_.Add(static_cast<int>(index), frame.frame.time, frame.map_key, frame.camera_from_map);
  const auto& estimate = rig_.estimate();
  const bool rigid = estimate && estimate->rigid;
  if (rigid == rig_reported_) return;
  rig_reported_ = rigid;
  if (!estimate) return;
  std::string detail = maps_.at(frame.map_key).name + ": " + estimate->ToString();
  if (rigid && options_.baseline_m > 0) {
    detail += ", one map unit is " + FormatNumber(options_.baseline_m / estimate->Baseline(), 4) + " m";
  }
  AddEvent(frame.frame.time, "rig", detail);
}

void Session::CheckCalibration(std::size_t index, const engine::TrackedFrame& frame) {
  Camera& camera = cameras_[index];
  camera.calibration_monitor->Add(frame);
  const auto warning = camera.calibration_monitor->TakeWarning();
  if (!warning) return;
  const std::string which = cameras_.size() > 1 ? "camera " + std::to_string(index) + ": " : std::string();
  AddEvent(frame.frame.time, "warning", which + *warning);
  Advise(&camera, *warning);
}

void Session::Advise(Camera* camera, const std::string& sentence) {
  constexpr Timestamp kShown = std::chrono::seconds(15);
  camera->advice = sentence;
  camera->advice_end = camera->last_time + kShown;
}

CalibrationMonitor::Profile Session::LensErrors(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  return cameras_.at(camera).calibration_monitor->profile();
}

std::optional<RigEstimate> Session::Rig() const {
  const std::scoped_lock lock(mutex_);
  return rig_.estimate();
}

void Session::OfferToMapper(Camera* camera, const engine::TrackedFrame& frame) {
  engine::Tracker& tracker = *camera->tracker;
  std::optional<engine::InitialPair> pair = tracker.TakeInitialPair();
  std::optional<engine::KeyFrameCandidate> candidate = tracker.TakeKeyFrameCandidate();
  if (!pair && !candidate) return;
  std::uint64_t key = 0;
  {
    const std::scoped_lock lock(mutex_);
    key = camera->map_key;
    const auto found = maps_.find(key);
    if (found == maps_.end() || key != active_key_) return;
    if (pair && found->second.snapshot && found->second.snapshot->HasFinitePoints()) return;
    if (candidate && !MayExtend(found->second, frame.camera_from_map)) candidate.reset();
  }
  if (saver_) saver_->InterruptMaintenance();  // the active map has priority
  if (pair) mapping_.Start(key, std::move(*pair));
  if (candidate) mapping_.Offer(key, std::move(*candidate), tracker.TakeReports());
}

void Session::OnMapperUpdate(const MappingThread::MapperUpdate& update) {
  using Kind = engine::MapperEvent::Kind;
  // Visual words of new keyframes are computed before locking, so that frames are processed meanwhile.
  std::vector<engine::KeyFrameWords> described;
  if (update.snapshot) described = index_.DescribeNew(update.key, *update.snapshot);
  const std::scoped_lock lock(mutex_);
  const auto found = maps_.find(update.key);
  // A late update of a map that was closed or discarded meanwhile is ignored.
  if (found == maps_.end() || update.key != active_key_ || !found->second.Exists()) return;
  SessionMap& map = found->second;
  if (update.join && !IsAwaited(*update.join, map)) return;
  if (update.snapshot) {
    map.UpdateSnapshot(update.snapshot);
    index_.SetMap(map.key, update.snapshot, described);
  }
  if (update.join) {
    HandleJoinAttempt(update.join->attempt, &map);
  } else if (update.snapshot) {
    RequestJoin(map);
  }
  for (const engine::MapperEvent& event : update.events) {
    switch (event.kind) {
      case Kind::kMapStarted:
        map.started = event.time;
        map.provisional = true;
        map.initialization_monitor = InitializationMonitor();
        for (std::size_t i = 0; i < cameras_.size(); ++i) {
          if (cameras_[i].map_key == map.key && cameras_[i].initializing) association_.SetTracked(i, map.key);
        }
        AddEvent(event.time, "map", "started " + map.name + ": " + event.detail);
        break;
      case Kind::kStartFailed:
        AddEvent(event.time, "warning", "could not initialize " + map.name + ": " + event.detail);
        for (Camera& camera : cameras_) {
          if (camera.map_key == map.key && camera.initializing) {
            camera.order = map.snapshot     ? Camera::Order::kStartAgain
                           : map.after_loss ? Camera::Order::kStartAfterLoss
                                            : Camera::Order::kStart;
          }
        }
        break;
      case Kind::kKeyFrame:
        AddEvent(event.time, "keyframe", "sixdof in " + map.name + ": " + event.detail);
        break;
      case Kind::kPanoramaOpened:
        AddEvent(event.time, "panorama", "opened in " + map.name + ": " + event.detail);
        break;
      case Kind::kPanoramaKeyFrame:
        AddEvent(event.time, "keyframe", "panorama in " + map.name + ": " + event.detail);
        break;
      case Kind::kLocalized:
        AddEvent(event.time, "keyframe", "localized in " + map.name + ": " + event.detail);
        break;
      case Kind::kConverted:
        AddEvent(event.time, "points", map.name + ": " + event.detail);
        break;
      case Kind::kKeyFrameRemoved:
        AddEvent(event.time, "keyframe", "removed from " + map.name + " as redundant: " + event.detail);
        break;
      case Kind::kLoopClosed:
        AddEvent(event.time, "loop", "closed in " + map.name + ": " + event.detail);
        break;
      case Kind::kGlobalAdjustment:
        // The last part of the detail is the duration, which differs between runs; events must not.
        AddEvent(event.time, "adjustment",
                 map.name + ": " + event.detail.substr(0, event.detail.rfind(", ")));
        break;
    }
  }
}

Session::Shown Session::ShownWith(const engine::TrackedFrame& frame) const {
  const std::scoped_lock lock(mutex_);
  Shown shown;
  const Camera& camera = cameras_.at(static_cast<std::size_t>(frame.frame.camera));
  if (frame.frame.time < camera.advice_end) shown.advice = camera.advice;
  if (options_.may_write) {
    const bool extended = active_key_ != 0 && active_key_ == frame.map_key;
    shown.mapping = MappingStatusOf(frame, extended);
  }
  const auto found = maps_.find(frame.map_key);
  if (found == maps_.end()) return shown;
  shown.map_name = found->second.name;
  shown.scene = found->second.scene;
  return shown;
}

std::vector<std::string> Session::MapNames() const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [key, map] : maps_) {
    if (map.Exists()) names.push_back(map.name);
  }
  return names;
}

std::vector<Session::MapState> Session::Maps() const {
  const std::scoped_lock lock(mutex_);
  std::vector<MapState> states;
  for (const auto& [key, map] : maps_) {
    states.push_back({key, map.name, map.policy, map.snapshot, map.scene, map.discarded, map.joined_into});
  }
  return states;
}

std::vector<Event> Session::TakeEvents() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(events_, {});
}

void Session::Finish() {
  if (std::exchange(finished_, true)) return;
  std::exception_ptr failure;
  try {
    mapping_.Finish();
  } catch (...) {
    failure = std::current_exception();  // what was mapped before is saved all the same
  }
  if (saver_) {
    saver_->EndMaintenance();
    saver_->Flush();  // so that failed saves are repeated below
    {
      const std::scoped_lock lock(mutex_);
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
