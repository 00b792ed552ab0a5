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
               [this](const MappingThread::MapperUpdate& news) { OnMapperUpdate(news); }) {
  // Trackers and mapper have the processors; OpenCV's own threads would only get into their way.
  cv::setNumThreads(1);
  engine::TrackerOptions tracker_options = options.tracker;
  tracker_options.build_maps = options.may_write;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Camera camera;
    camera.tracker = std::make_unique<engine::Tracker>(tracker_options, cameras[i], options.seed + i);
    camera.lens = std::make_unique<CalibrationMonitor>(cameras[i]);
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
    // Whoever wants to know calls Finish before.
    spdlog::error("{}", error.what());
  }
}

void Session::AddEvent(Timestamp time, std::string event, std::string detail) {
  events_.push_back({time, std::move(event), std::move(detail)});
}

CameraPlaceFinder Session::FollowOrders(std::size_t index, Timestamp time) {
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
    if (order == Camera::Order::kStart || order == Camera::Order::kStartAfterLoss) camera->starting = true;
    if (order == Camera::Order::kLeave || order == Camera::Order::kGo) camera->starting = false;
    if (const auto found = maps_.find(camera->map_key); found != maps_.end()) {
      snapshot = found->second.snapshot;
      key = camera->map_key;
    }
    // A map of directions alone waits for its start still.
    if (snapshot && snapshot->HasFinitePoints()) camera->starting = false;
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
  const CameraPlaceFinder places = FollowOrders(index, frame.time);
  engine::TrackedFrame tracked = camera.tracker->Track(frame, &places);
  HandleResult(index, &tracked);
  if (options_.may_write) {
    OfferToMapper(&camera, tracked);
    if (!options_.threaded) mapping_.RunInTurn();
    Autosave(frame.time);
  }
  return tracked;
}

void Session::HandleResult(std::size_t index, engine::TrackedFrame* frame) {
  const std::scoped_lock lock(mutex_);
  Camera* const camera = &cameras_[index];
  camera->last_time = frame->frame.time;
  if (!engine::HasPose(frame->state)) {
    association_.Lost(index);
  } else if (const auto map = maps_.find(frame->map_key); camera->order != Camera::Order::kNone ||
                                                          map == maps_.end() || !map->second.IsActive() ||
                                                          !association_.Tracked(index, frame->map_key)) {
    association_.Lost(index);
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
    WatchLens(index, *frame);
    WatchRig(index, *frame);
  } else if (frame->state == engine::TrackingState::kLost && !camera->lost_since) {
    camera->lost_since = frame->frame.time;
  }
  // Of several cameras, one that is tracked shows that a start holds.
  if (has_pose || !association_.AnyTracked()) WatchProbation(camera, *frame);
  if (!has_pose) WatchLoss(camera, *frame);
}

// The frame's pose is in a map that is not the cameras' any more: while it was worked out, another camera was
// found elsewhere, or somebody chose another map.
void Session::RejectPose(Camera* camera, engine::TrackedFrame* frame) {
  frame->state = engine::TrackingState::kLost;
  frame->quality_class = engine::TrackingQuality::kLost;
  frame->map.reset();
  frame->map_key = 0;
  frame->matches.clear();
  frame->finite_points = frame->infinite_points = 0;
  frame->hint = "look where the other camera looks";
  camera->doubts = {};
  if (camera->order == Camera::Order::kNone) camera->order = Camera::Order::kGo;
}

void Session::ReportRejection(Camera* camera, engine::TrackedFrame* frame) {
  const auto name = [&](std::uint64_t key) {
    const auto found = maps_.find(key);
    return found != maps_.end() ? found->second.name : std::string();
  };
  const bool news =
      camera->doubts.See(frame->frame.time, engine::HasPose(frame->state), frame->verdict, name);
  const std::string& words = camera->doubts.words();
  if (words.empty()) return;
  frame->hint = "not sure: " + words;
  if (!news) return;
  const std::string by =
      cameras_.size() > 1 ? "camera " + std::to_string(frame->frame.camera) + ": " : std::string();
  AddEvent(frame->frame.time, "not sure", by + words);
}

void Session::WatchRig(std::size_t index, const engine::TrackedFrame& frame) {
  if (cameras_.size() < 2 || index > 1) return;
  rig_.Add(static_cast<int>(index), frame.frame.time, frame.map_key, frame.camera_from_map);
  const auto& estimate = rig_.estimate();
  const bool rigid = estimate && estimate->rigid;
  if (rigid == rig_told_) return;
  rig_told_ = rigid;
  if (!estimate) return;
  std::string words = maps_.at(frame.map_key).name + ": " + estimate->Words();
  if (rigid && options_.baseline_m > 0) {
    words += ", one unit of the map is " + FormatNumber(options_.baseline_m / estimate->Baseline(), 4) + " m";
  }
  AddEvent(frame.frame.time, "rig", words);
}

void Session::WatchLens(std::size_t index, const engine::TrackedFrame& frame) {
  Camera& camera = cameras_[index];
  camera.lens->Add(frame);
  const auto warning = camera.lens->TakeWarning();
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
  return cameras_.at(camera).lens->profile();
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
    if (found == maps_.end() || key != extended_key_) return;
    if (pair && found->second.snapshot && found->second.snapshot->HasFinitePoints()) return;
    if (candidate && !MayExtend(found->second, frame.camera_from_map)) candidate.reset();
  }
  if (saver_) saver_->InterruptMaintenance();  // the present map comes first
  if (pair) mapping_.Start(key, std::move(*pair));
  if (candidate) mapping_.Offer(key, std::move(*candidate), tracker.TakeReports());
}

void Session::OnMapperUpdate(const MappingThread::MapperUpdate& news) {
  using Kind = engine::MapperEvent::Kind;
  // New keyframes are described before the lock: frames go on meanwhile.
  std::vector<maps::KeyFrameWords> described;
  if (news.snapshot) described = index_.DescribeNew(news.key, *news.snapshot);
  const std::scoped_lock lock(mutex_);
  const auto found = maps_.find(news.key);
  // MapperUpdate that comes late, of a map that was closed or given up meanwhile, is let go.
  if (found == maps_.end() || news.key != extended_key_ || !found->second.IsActive()) return;
  SessionMap& map = found->second;
  if (news.join && !Expects(*news.join, map)) return;
  if (news.snapshot) {
    map.Grow(news.snapshot);
    index_.SetMap(map.key, news.snapshot, described);
  }
  if (news.join) {
    EndJoining(news.join->attempt, &map);
  } else if (news.snapshot) {
    AskToJoin(map);
  }
  for (const engine::MapperEvent& event : news.events) {
    switch (event.kind) {
      case Kind::kMapStarted:
        map.started = event.time;
        map.on_probation = true;
        map.start_watch = InitializationMonitor();
        for (std::size_t i = 0; i < cameras_.size(); ++i) {
          if (cameras_[i].map_key == map.key && cameras_[i].starting) association_.Tracked(i, map.key);
        }
        AddEvent(event.time, "map", "started " + map.name + ": " + event.detail);
        break;
      case Kind::kStartFailed:
        AddEvent(event.time, "warning", "no start for " + map.name + ": " + event.detail);
        for (Camera& camera : cameras_) {
          if (camera.map_key == map.key && camera.starting) {
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
        AddEvent(event.time, "keyframe",
                 "removed from " + map.name + ", as others know what it shows: " + event.detail);
        break;
      case Kind::kLoopClosed:
        AddEvent(event.time, "loop", "closed in " + map.name + ": " + event.detail);
        break;
      case Kind::kGlobalAdjustment:
        // Its last words are how long it took, which differs from run to run; events of one input do not.
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
    const bool grows = extended_key_ != 0 && extended_key_ == frame.map_key;
    shown.mapping = MappingStatusOf(frame, grows);
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
    if (map.IsActive()) names.push_back(map.name);
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
    failure = std::current_exception();  // what it made before is saved all the same
  }
  if (saver_) {
    saver_->EndMaintenance();
    saver_->Flush();  // so that what fails now is tried again with the rest
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
