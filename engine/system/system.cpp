// SPDX-License-Identifier: Apache-2.0
#include "engine/system/system.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> SystemOptions::Validate() const {
  return OptionCheck()
      .NotNegative(lost_time_before_new_map, "loss before a new map")
      .Contained(provisional.Validate())
      .Contained(tracker.Validate())
      .fault();
}

System::System(const SystemOptions& options, std::vector<std::shared_ptr<const CameraModel>> cameras)
    : options_(Checked(options)),
      association_(cameras.size()),
      lenses_(options.mapper.lens.lenses),
      mapping_(options.mapper, options.threaded && options.extend_maps,
               [this](const MappingThread::MapperUpdate& update) { OnMapperUpdate(update); }) {
  TrackerOptions tracker_options = options.tracker;
  tracker_options.build_maps = options.extend_maps;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Camera camera;
    camera.tracker = std::make_unique<Tracker>(tracker_options, cameras[i], options.seed + i);
    camera.calibration_monitor = std::make_unique<CalibrationMonitor>(cameras[i]);
    for (std::size_t lens = 0; lens < lenses_.size(); ++lens) {
      if (lenses_[lens].model == cameras[i]) camera.lens_index = lens;
    }
    camera.model = std::move(cameras[i]);
    cameras_.push_back(std::move(camera));
  }
}

System::~System() = default;

FrameInspection System::Inspect(const TrackedFrame& frame) const {
  return cameras_.at(static_cast<std::size_t>(frame.frame.camera)).tracker->Inspect(frame);
}

TrackedFrame System::Process(const Frame& frame) {
  const auto index = static_cast<std::size_t>(frame.camera);
  Tracker& tracker = *cameras_.at(index).tracker;
  const CameraPlaceFinder places = ApplyOrder(index, frame.time);
  TrackedFrame tracked = tracker.Track(frame, &places);
  {
    const std::scoped_lock lock(mutex_);
    HandleResult(index, &tracked);
  }
  if (options_.extend_maps) {
    OfferToMapper(index, tracked);
    if (!options_.threaded) mapping_.RunLockstep();
  }
  return tracked;
}

CameraPlaceFinder System::ApplyOrder(std::size_t index, Timestamp time) {
  using Order = MapAssignment::Order;
  Camera* const camera = &cameras_[index];
  Tracker& tracker = *camera->tracker;
  std::uint64_t searched = 0;
  std::optional<CameraPlaceFinder::Prediction> prediction;
  std::shared_ptr<const MapSnapshot> snapshot;
  std::shared_ptr<const CameraModel> model;
  std::uint64_t key = 0;
  auto order = Order::kNone;
  {
    const std::scoped_lock lock(mutex_);
    model = camera->model;
    if (const auto found = maps_.find(camera->assignment.map()); found != maps_.end()) {
      snapshot = found->second.snapshot;
      key = found->first;
    }
    order = camera->assignment.TakeOrder(snapshot && snapshot->HasFinitePoints());
    searched = association_.SearchedMap(index);
    if (snapshot && index < 2 && !association_.IsTracked(index)) {
      if (const auto pose = rig_.Predict(static_cast<int>(index), time, key))
        prediction = CameraPlaceFinder::Prediction{key, snapshot, *pose};
    }
  }
  if (order == Order::kStart) {
    tracker.StartNewMap(/*search_known_maps=*/false);
  } else if (order == Order::kStartAfterLoss) {
    tracker.StartNewMap(/*search_known_maps=*/true);
  } else if (order == Order::kStartAgain) {
    tracker.StartFailed();
  } else if (order != Order::kNone) {
    tracker.Reset();
  }
  tracker.SetCamera(std::move(model));
  tracker.SetMap(std::move(snapshot), key);
  const PlaceFinder* const all = finder_ != nullptr ? finder_ : &index_;
  return CameraPlaceFinder(all, searched, std::move(prediction));
}

void System::HandleResult(std::size_t index, TrackedFrame* frame) {
  Camera* const camera = &cameras_[index];
  const Timestamp now = camera->last_time = frame->frame.time;
  if (!HasPose(frame->state)) {
    association_.SetLost(index);
  } else if (const auto map = maps_.find(frame->map_key); camera->assignment.has_order() ||
                                                          map == maps_.end() || !map->second.Exists() ||
                                                          !association_.SetTracked(index, frame->map_key)) {
    association_.SetLost(index);
    RejectPose(index, frame);
  }
  const bool has_pose = HasPose(frame->state);
  if (has_pose && frame->map_key != camera->assignment.map()) {
    EnterTrackedMap(index, frame->map_key, now);
  } else if (frame->state == TrackingState::kRelocalized) {
    Emit(now, frame->map_key, Relocalized{}, index);
  }
  if (has_pose) {
    camera->assignment.SetTracked();
    CheckCalibration(index, *frame);
    UpdateRig(index, *frame);
  } else if (frame->state == TrackingState::kLost) {
    camera->assignment.SetLost(now);
  }
  // With several cameras, one that is tracked shows that the initialization holds.
  if (has_pose || !association_.AnyTracked()) CheckProvisionalMap(*camera, *frame);
  if (!has_pose) CheckLoss(index, *frame);
}

// Handles a pose in a map that the cameras are no longer in: while the frame was tracked, another camera
// relocalized elsewhere, or the application chose another map.
void System::RejectPose(std::size_t index, TrackedFrame* frame) {
  Emit(frame->frame.time, frame->map_key, PoseRejected{}, index);
  frame->state = TrackingState::kLost;
  frame->quality_class = TrackingQuality::kLost;
  frame->map.reset();
  frame->map_key = 0;
  frame->matches.clear();
  frame->finite_points = frame->infinite_points = 0;
  frame->hint = "Point this camera at what the other camera sees";
  cameras_[index].assignment.SearchAgain();
}

void System::UpdateRig(std::size_t index, const TrackedFrame& frame) {
  if (cameras_.size() < 2 || index > 1) return;
  rig_.Add(static_cast<int>(index), frame.frame.time, frame.map_key, frame.camera_from_map);
  const auto& estimate = rig_.estimate();
  const bool rigid = estimate && estimate->rigid;
  if (rigid == rig_reported_) return;
  rig_reported_ = rigid;
  if (estimate) Emit(frame.frame.time, frame.map_key, RigChanged{*estimate}, index);
}

void System::CheckCalibration(std::size_t index, const TrackedFrame& frame) {
  const Camera& camera = cameras_[index];
  camera.calibration_monitor->Add(frame);
  const auto mismatch = camera.calibration_monitor->TakeMismatch();
  // A residual pattern is expected while the calibration is still being estimated.
  const bool estimating = camera.lens_index && !lenses_[*camera.lens_index].fixed;
  if (mismatch && !estimating) Emit(frame.frame.time, frame.map_key, CalibrationMismatch{*mismatch}, index);
}

void System::EnterTrackedMap(std::size_t index, std::uint64_t key, Timestamp time) {
  const std::uint64_t previous = cameras_[index].assignment.map();
  cameras_[index].assignment.Follow(key);
  Emit(time, key, MapEntered{}, index);
  // The other cameras abandon their search and enter this map (ptamm §3.3).
  for (Camera& other : cameras_) {
    if (other.assignment.map() != key) other.assignment.Enter(key);
  }
  if (!options_.extend_maps || active_key_ == key) return;
  LeavePreviousMap(previous, key, time);
  const MapState& map = maps_.at(key);
  ActivateNow(map);
  RequestJoin(map);
}

// The previous map becomes idle, and is extended again when a camera returns to it.
void System::LeavePreviousMap(std::uint64_t previous, std::uint64_t entered, Timestamp time) {
  const auto found = maps_.find(previous);
  if (found == maps_.end() || !found->second.Exists()) return;
  MapState& left = found->second;
  left.provisional.End();
  Emit(time, previous, MapLeft{});
  if (!left.after_loss) return;
  if (left.snapshot && left.snapshot->HasFinitePoints()) {
    left.join_with = entered;
    return;
  }
  left.discarded = true;
  index_.RemoveMap(previous);
  MapDiscarded event;
  event.reason = MapDiscarded::Reason::kRelocalizedElsewhere;
  event.other = entered;
  Emit(time, previous, event);
}

void System::CheckProvisionalMap(const Camera& camera, const TrackedFrame& frame) {
  const auto found = maps_.find(camera.assignment.map());
  if (found == maps_.end()) return;
  MapState& map = found->second;
  const auto reason =
      map.provisional.Check(options_.provisional, {.frame = frame,
                                                   .in_map = frame.map_key == map.key,
                                                   .map = map.snapshot.get(),
                                                   .lost_since = camera.assignment.lost_since(),
                                                   .may_extend = options_.extend_maps,
                                                   .may_discard = map.permissions.discard});
  if (reason) Discard(map.key, frame.frame.time, *reason);
}

// Starts a new map for a camera that is lost and recognises no map.
void System::CheckLoss(std::size_t index, const TrackedFrame& frame) {
  const MapAssignment& assignment = cameras_[index].assignment;
  if (!options_.extend_maps || !options_.new_map_when_lost || association_.AnyTracked()) return;
  const auto found = maps_.find(assignment.map());
  // A map that the user stopped, or that may not be extended, is not left automatically.
  if (found == maps_.end() || found->second.provisional.is_pending() || active_key_ != found->first) return;
  const Timestamp now = frame.frame.time;
  if (!assignment.IsLostFor(options_.lost_time_before_new_map, now)) return;
  if (frame.relocalization.rejection == RejectionReason::kUnconfirmed) return;  // relocalization is imminent
  const std::uint64_t lost_in = found->first;
  const std::uint64_t key = NewKey();
  if (key == 0) return;
  Emit(now, key, MapStartedAfterLoss{lost_in}, index);
  StartMapAt(key, index, true);
}

void System::Discard(std::uint64_t key, Timestamp time, MapDiscarded event) {
  MapState& map = maps_.at(key);
  const std::uint64_t next_key = NewKey();
  if (next_key == 0) return;
  map.discarded = true;
  index_.RemoveMap(key);
  MapState& next = AddState(next_key);
  next.after_loss = map.after_loss;
  event.replacement = next.key;
  Emit(time, key, event);
  AssignMapper(next.key, nullptr);
  association_.Begin(next.key);
  for (Camera& camera : cameras_) {
    if (camera.assignment.map() == key) camera.assignment.Replace(next.key, next.after_loss);
  }
}

bool System::MayAddKeyFrame(const MapState& map, const Rigid3& camera_from_map) const {
  if (!options_.extend_maps || !map.Exists() || !map.permissions.extend) return false;
  return !map.permissions.bounds || map.permissions.bounds->contains(camera_from_map.OriginInSource());
}

void System::OfferToMapper(std::size_t index, const TrackedFrame& frame) {
  Tracker& tracker = *cameras_[index].tracker;
  std::optional<InitialPair> pair = tracker.TakeInitialPair();
  std::optional<KeyFrameCandidate> candidate = tracker.TakeKeyFrameCandidate();
  if (!pair && !candidate) return;
  std::uint64_t key = 0;
  {
    const std::scoped_lock lock(mutex_);
    key = cameras_[index].assignment.map();
    const auto found = maps_.find(key);
    if (found == maps_.end() || key != active_key_) {
      if (pair) tracker.StartFailed();
      return;
    }
    // With finite points in the map, the next frame ends the initialization.
    if (pair && found->second.snapshot && found->second.snapshot->HasFinitePoints()) return;
    if (candidate && !MayAddKeyFrame(found->second, frame.camera_from_map)) candidate.reset();
  }
  if (!pair && !candidate) return;
  bool accepted = false;
  if (pair) {
    accepted = mapping_.Start(key, std::move(*pair));
    if (!accepted) tracker.StartFailed();
  }
  if (candidate) {
    accepted = mapping_.Offer(key, std::move(*candidate), tracker.TakeReports());
    if (accepted) tracker.KeyFrameAccepted();
  }
  const std::scoped_lock lock(mutex_);
  Emit(frame.frame.time, key, KeyFrameOffered{accepted}, index);
}

void System::OnMapperUpdate(const MappingThread::MapperUpdate& update) {
  // Visual words of new keyframes are computed before locking, so that frames are processed meanwhile.
  std::vector<KeyFrameWords> described;
  if (update.snapshot) described = index_.DescribeNew(update.key, *update.snapshot);
  {
    const std::scoped_lock lock(mutex_);
    if (!update.lenses.empty()) SetLenses(update.lenses, update.events.back().time);
    if (!update.failure.empty()) Emit(LastTime(), update.key, MapperFailed{update.failure});
    const auto found = maps_.find(update.key);
    // A late update of a map that was closed or discarded meanwhile is ignored.
    const bool late = found == maps_.end() || update.key != active_key_ || !found->second.Exists();
    if (!late && (!update.join || IsAwaited(*update.join, found->second))) {
      MapState& map = found->second;
      if (update.snapshot) {
        map.snapshot = update.snapshot;
        index_.SetMap(map.key, update.snapshot, described);
        Emit(LastTime(), map.key, MapUpdated{update.snapshot});
      }
      if (update.join) {
        HandleJoinAttempt(update.join->attempt, &map);
      } else if (update.snapshot) {
        RequestJoin(map);
      }
      for (const MapperEvent& event : update.events) HandleMapperEvent(event, &map);
    }
  }
  if (event_hook_) event_hook_();
}

void System::HandleMapperEvent(const MapperEvent& event, MapState* map) {
  if (std::holds_alternative<MapperEvent::MapStarted>(event.what)) {
    map->provisional.Begin(event.time);
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const MapAssignment& assignment = cameras_[i].assignment;
      if (assignment.map() == map->key && assignment.is_starting()) association_.SetTracked(i, map->key);
    }
  } else if (std::holds_alternative<MapperEvent::StartFailed>(event.what)) {
    for (Camera& camera : cameras_) {
      if (camera.assignment.map() == map->key)
        camera.assignment.FailStart(map->snapshot != nullptr, map->after_loss);
    }
  }
  Emit(event.time, map->key, event);
}

// Passes the mapper's estimates of unknown calibrations to the trackers; to be called together with the
// update of the snapshot that uses these lenses.
void System::SetLenses(const std::vector<EstimatedLens>& lenses, Timestamp time) {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    Camera& camera = cameras_[i];
    if (!camera.lens_index) continue;
    const EstimatedLens& lens = lenses[*camera.lens_index];
    const EstimatedLens& before = lenses_[*camera.lens_index];
    if (lens.model == before.model && lens.focal_sigma == before.focal_sigma && lens.fixed == before.fixed)
      continue;
    Emit(time, 0, LensEstimated{lens}, i);
    if (lens.model == camera.model) continue;
    camera.model = lens.model;
    camera.calibration_monitor = std::make_unique<CalibrationMonitor>(lens.model);
  }
  lenses_ = lenses;
}

std::optional<EstimatedLens> System::EstimatedLensOf(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  const auto& index = cameras_.at(camera).lens_index;
  return index ? std::optional(lenses_[*index]) : std::nullopt;
}

std::vector<EstimatedLens> System::EstimatedLenses() const {
  const std::scoped_lock lock(mutex_);
  return lenses_;
}

// Maps

System::MapState& System::AddState(std::uint64_t key) {
  MapState& map = maps_[key];
  map.key = key;
  return map;
}

std::uint64_t System::NewKey() {
  if (options_.new_map_key) return options_.new_map_key();
  return maps_.empty() ? 1 : maps_.rbegin()->first + 1;
}

Timestamp System::LastTime() const {
  Timestamp time{};
  for (const Camera& camera : cameras_) time = std::max(time, camera.last_time);
  return time;
}

void System::AddMap(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot,
                    const MapPermissions& permissions) {
  const std::scoped_lock lock(mutex_);
  MapState& map = AddState(key);
  map.snapshot = std::move(snapshot);
  map.permissions = permissions;
}

void System::SetSnapshot(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot) {
  const std::scoped_lock lock(mutex_);
  if (const auto found = maps_.find(key); found != maps_.end() && key != active_key_)
    found->second.snapshot = std::move(snapshot);
}

bool System::ReplaceSnapshot(std::uint64_t key, const std::shared_ptr<const MapSnapshot>& expected,
                             std::shared_ptr<const MapSnapshot> snapshot) {
  const std::scoped_lock lock(mutex_);
  const auto found = maps_.find(key);
  if (found == maps_.end() || IsUsed(key) || found->second.snapshot != expected) return false;
  index_.SetMap(key, snapshot);
  found->second.snapshot = std::move(snapshot);
  return true;
}

void System::SetPermissions(std::uint64_t key, const MapPermissions& permissions) {
  const std::scoped_lock lock(mutex_);
  if (const auto found = maps_.find(key); found != maps_.end()) found->second.permissions = permissions;
}

void System::StartMap(std::uint64_t key, std::size_t camera) {
  const std::scoped_lock lock(mutex_);
  StartMapAt(key, camera, false);
}

void System::StartMapAt(std::uint64_t key, std::size_t camera, bool after_loss) {
  const std::uint64_t previous = active_key_;
  if (previous != 0) LeaveMapNow(previous);
  MapState& map = AddState(key);
  if (after_loss) map.after_loss = true;
  ActivateNow(map);
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (i == camera) {
      cameras_[i].assignment.Start(key, after_loss);
    } else {
      cameras_[i].assignment.WaitFor(key);
    }
  }
  association_.Begin(key);
}

void System::EnterMap(std::uint64_t key, std::size_t camera) {
  const std::scoped_lock lock(mutex_);
  const MapState& map = maps_.at(key);
  const std::uint64_t previous = cameras_.at(camera).assignment.map();
  if (previous == key) return ActivateNow(map);
  if (previous != 0) LeaveMapNow(previous);
  association_.Release();
  for (Camera& each : cameras_) each.assignment.Enter(key);
  ActivateNow(map);
}

void System::LeaveMap(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  LeaveMapNow(key);
}

void System::LeaveMapNow(std::uint64_t key) {
  if (active_key_ == key) AssignMapper(0, nullptr);
  const auto found = maps_.find(key);
  if (found == maps_.end() || !found->second.Exists()) return;
  Timestamp time{};
  for (Camera& camera : cameras_) {
    time = std::max(time, camera.last_time);
    if (camera.assignment.map() == key) camera.assignment.Leave();
  }
  if (association_.map() == key) association_.Release();
  found->second.provisional.End();
  const bool forgotten = found->second.snapshot == nullptr;
  if (forgotten) maps_.erase(found);
  Emit(time, key, MapLeft{forgotten});
}

void System::RemoveMap(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  LeaveMapNow(key);
  const auto found = maps_.find(key);
  if (found == maps_.end()) return;
  found->second.discarded = true;  // Late updates of the mapper are ignored.
  index_.RemoveMap(key);
}

void System::Activate(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  ActivateNow(maps_.at(key));
}

void System::ActivateNow(const MapState& map) {
  const bool extend = options_.extend_maps && map.permissions.extend;
  AssignMapper(extend ? map.key : 0, extend ? map.snapshot : nullptr);
}

void System::AssignMapper(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot) {
  active_key_ = key;
  joining_.reset();  // the mapper begins with the snapshot, whatever it had joined
  mapping_.Adopt(key, std::move(snapshot));
}

std::uint64_t System::CurrentMap(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  return cameras_.at(camera).assignment.map();
}

std::uint64_t System::ActiveMap() const {
  const std::scoped_lock lock(mutex_);
  return active_key_;
}

std::vector<std::uint64_t> System::MapsInUse() const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::uint64_t> keys;
  for (const Camera& camera : cameras_) keys.push_back(camera.assignment.map());
  return keys;
}

bool System::IsInUse(std::uint64_t key) const {
  const std::scoped_lock lock(mutex_);
  return IsUsed(key);
}

bool System::IsUsed(std::uint64_t key) const {
  return key == active_key_ || (joining_ && joining_->from == key) ||
         std::any_of(cameras_.begin(), cameras_.end(),
                     [key](const Camera& camera) { return camera.assignment.map() == key; });
}

bool System::IsProvisional(std::uint64_t key) const {
  const std::scoped_lock lock(mutex_);
  const auto found = maps_.find(key);
  return found != maps_.end() && found->second.provisional.is_pending();
}

std::optional<RigEstimate> System::Rig() const {
  const std::scoped_lock lock(mutex_);
  return rig_.estimate();
}

CalibrationMonitor::Profile System::RadialErrors(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  return cameras_.at(camera).calibration_monitor->profile();
}

std::vector<SystemEvent> System::TakeEvents() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(events_, {});
}

}  // namespace docent::engine
