// SPDX-License-Identifier: Apache-2.0
#include "engine/system/system.h"

#include <algorithm>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

// Maps that are only viewed are extended for visual odometry, in memory.
MapperOptions MapperOptionsOf(const SystemOptions& options) {
  MapperOptions mapper = options.mapper;
  mapper.temporary = !options.extend_maps;
  if (mapper.temporary) mapper.images.reset();
  return mapper;
}

}  // namespace

System::System(const SystemOptions& options, std::vector<std::shared_ptr<const CameraModel>> cameras)
    : options_(Checked(options)),
      state_(cameras.size()),
      calibrations_(&state_),
      policy_(options_, &state_, &calibrations_, &index_, &mapping_),
      mapping_(MapperOptionsOf(options), options.threaded,
               [this](const MappingThread::MapperUpdate& update) { OnMapperUpdate(update); }) {
  state_.lenses = options.mapper.lens.lenses;
  TrackerOptions tracker_options = options.tracker;
  tracker_options.build_maps = options.extend_maps;
  tracker_options.initializer.estimate_readout &= options.mapper.lens.lenses.empty();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    SystemCamera camera;
    camera.tracker = std::make_unique<Tracker>(tracker_options, cameras[i], options.seed + i);
    camera.calibration_monitor = std::make_unique<CalibrationMonitor>(cameras[i]);
    for (std::size_t lens = 0; lens < state_.lenses.size(); ++lens) {
      if (state_.lenses[lens].model == cameras[i]) camera.lens_index = lens;
    }
    camera.model = std::move(cameras[i]);
    state_.cameras.push_back(std::move(camera));
  }
}

System::~System() = default;

FrameInspection System::Inspect(const TrackedFrame& frame) const {
  return state_.cameras.at(static_cast<std::size_t>(frame.frame.camera)).tracker->Inspect(frame);
}

TrackedFrame System::Process(const Frame& frame) {
  const auto index = static_cast<std::size_t>(frame.camera);
  Tracker& tracker = *state_.cameras.at(index).tracker;
  const CameraPlaceFinder places = ApplyOrder(index, frame.time);
  TrackedFrame tracked = tracker.Track(frame, &places);
  {
    const std::scoped_lock lock(mutex_);
    policy_.HandleResult(index, &tracked);
  }
  if (options_.extend_maps) {
    OfferToMapper(index, tracked);
  } else {
    ExtendCopy(index);
  }
  if (!options_.threaded) mapping_.RunLockstep();
  return tracked;
}

void System::Disconnect(std::size_t camera) {
  const std::scoped_lock lock(mutex_);
  policy_.Disconnect(camera);
}

CameraPlaceFinder System::ApplyOrder(std::size_t index, Timestamp time) {
  using Order = MapAssignment::Order;
  SystemCamera* const camera = &state_.cameras[index];
  Tracker& tracker = *camera->tracker;
  std::uint64_t searched = 0;
  std::optional<CameraPlaceFinder::Prediction> prediction;
  std::shared_ptr<const MapSnapshot> snapshot, copy;
  std::shared_ptr<const CameraModel> model;
  std::uint64_t key = 0;
  auto order = Order::kNone;
  {
    const std::scoped_lock lock(mutex_);
    camera->is_connected = true;
    model = camera->model;
    if (const auto found = state_.maps.find(camera->assignment.map()); found != state_.maps.end()) {
      snapshot = found->second.snapshot;
      key = found->first;
      if (snapshot && state_.copy.of == snapshot) copy = state_.copy.extended;
    }
    order = camera->assignment.TakeOrder(snapshot && snapshot->HasFinitePoints());
    searched = state_.association.SearchedMap(index);
    if (snapshot && index < 2 && !state_.association.IsTracked(index)) {
      if (const auto pose = state_.rig.Predict(static_cast<int>(index), time, key))
        prediction = CameraPlaceFinder::Prediction{key, snapshot, *pose};
    }
  }
  if (order == Order::kStart) {
    tracker.StartNewMap(/*search_known_maps=*/false);
  } else if (order == Order::kStartAfterLoss) {
    tracker.StartNewMap(/*search_known_maps=*/true);
  } else if (order == Order::kStartAgain) {
    tracker.StartFailed();
  } else if (order == Order::kGiveDepth) {
    tracker.InitializeTrackedMap();
  } else if (order != Order::kNone) {
    tracker.Reset();
  }
  tracker.SetCamera(std::move(model));
  tracker.SetMap(std::move(snapshot), key);
  tracker.SetOdometryCopy(std::move(copy));
  const PlaceFinder* const all = finder_ != nullptr ? finder_ : &index_;
  return CameraPlaceFinder(all, searched, std::move(prediction));
}

void System::OfferToMapper(std::size_t index, const TrackedFrame& frame) {
  Tracker& tracker = *state_.cameras[index].tracker;
  std::optional<InitialPair> pair = tracker.TakeInitialPair();
  std::optional<KeyFrameCandidate> candidate = tracker.TakeKeyFrameCandidate();
  std::optional<TrackedCorners> corners = tracker.TakeCorners();
  if (!pair && !candidate && !corners) return;
  std::uint64_t key = 0;
  {
    const std::scoped_lock lock(mutex_);
    const MapAssignment& assignment = state_.cameras[index].assignment;
    key = assignment.map();
    const auto found = state_.maps.find(key);
    // A map that was ordered during the frame is another one than the frame was tracked in.
    if (found == state_.maps.end() || key != state_.active_key || assignment.has_order()) {
      if (pair) tracker.StartFailed();
      return;
    }
    // With finite points in the map, the next frame ends the initialization.
    if (pair && found->second.snapshot && found->second.snapshot->HasFinitePoints()) return;
    if (candidate && !policy_.MayAddKeyFrame(found->second, frame.camera_from_map)) candidate.reset();
  }
  if (corners) mapping_.EstimateReadout(key, std::move(*corners));
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
  state_.Emit(frame.frame.time, key, KeyFrameOffered{accepted}, index);
}

void System::ExtendCopy(std::size_t index) {
  Tracker& tracker = *state_.cameras[index].tracker;
  const bool invalid = tracker.TakeInvalidOdometryCopy();
  std::optional<KeyFrameCandidate> candidate = tracker.TakeKeyFrameCandidate();
  std::uint64_t number = 0;
  {
    const std::scoped_lock lock(mutex_);
    const KnownMap* const map = state_.FindMap(state_.cameras[index].assignment.map());
    const auto snapshot = map ? map->snapshot : nullptr;
    state_.cameras[index].has_odometry = tracker.HasOdometry();
    // A camera that was relocalized does not take the copy away from one that depends on it.
    state_.copy.invalid = state_.copy.invalid || invalid;
    const bool needed = std::any_of(state_.cameras.begin(), state_.cameras.end(),
                                    [](const SystemCamera& camera) { return camera.has_odometry; });
    if (state_.copy.number != 0 && ((state_.copy.invalid && !needed) || state_.copy.of != snapshot)) {
      state_.copy = {};
      mapping_.Adopt(0, nullptr);
    }
    if (!candidate || !snapshot) return;
    if (state_.copy.number == 0) {
      state_.copy = {++copies_, snapshot, nullptr};
      mapping_.Adopt(state_.copy.number, snapshot);
    }
    number = state_.copy.number;
  }
  if (mapping_.Offer(number, std::move(*candidate), {})) tracker.KeyFrameAccepted();
}

void System::OnCopyExtended(const MappingThread::MapperUpdate& update) {
  {
    const std::scoped_lock lock(mutex_);
    if (!update.failure.empty()) state_.Emit(state_.LastTime(), 0, MapperFailed{update.failure});
    if (update.snapshot && update.key == state_.copy.number) state_.copy.extended = update.snapshot;
  }
  if (event_hook_ && !update.failure.empty()) event_hook_();
}

void System::OnMapperUpdate(const MappingThread::MapperUpdate& update) {
  if (!options_.extend_maps) return OnCopyExtended(update);
  // Visual words of new keyframes are computed before locking, so that frames are processed meanwhile.
  std::vector<KeyFrameWords> described;
  if (update.snapshot) described = index_.DescribeNew(update.key, *update.snapshot);
  {
    const std::scoped_lock lock(mutex_);
    if (!update.lenses.empty()) calibrations_.SetLenses(update.lenses, update.events.back().time);
    if (!update.failure.empty()) state_.Emit(state_.LastTime(), update.key, MapperFailed{update.failure});
    const auto found = state_.maps.find(update.key);
    // A late update of a map that was closed, discarded or adopted anew meanwhile is ignored.
    const bool late = found == state_.maps.end() || update.key != state_.active_key ||
                      update.adoption != state_.adoption || !found->second.Exists();
    if (!late && (!update.join || IsAwaited(*update.join, found->second))) {
      KnownMap& map = found->second;
      if (update.snapshot) {
        map.SetSnapshot(update.snapshot);
        index_.SetMap(map.key, update.snapshot, described);
        state_.Emit(state_.LastTime(), map.key, MapUpdated{update.snapshot});
      }
      if (update.join) {
        policy_.joins().Handle(update.join->attempt, &map);
      } else if (update.snapshot) {
        policy_.joins().Request(map);
      }
      for (const MapperEvent& event : update.events) policy_.HandleMapperEvent(event, &map);
    }
  }
  if (event_hook_) event_hook_();
}

bool System::IsAwaited(const MappingThread::MapperUpdate::Join& update, const KnownMap& into) {
  using Answer = MapJoinRequests::Answer;
  const Answer answer = policy_.joins().Check(update, into);
  if (answer == Answer::kChangedMeanwhile) policy_.Activate(into);
  return answer == Answer::kAwaited;
}

std::optional<EstimatedLens> System::EstimatedLensOf(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  const auto& index = state_.cameras.at(camera).lens_index;
  return index ? std::optional(state_.lenses[*index]) : std::nullopt;
}

std::vector<EstimatedLens> System::EstimatedLenses() const {
  const std::scoped_lock lock(mutex_);
  return state_.lenses;
}

// Maps

void System::AddMap(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot,
                    const MapPermissions& permissions) {
  const std::scoped_lock lock(mutex_);
  KnownMap& map = state_.AddMap(key);
  map.SetSnapshot(std::move(snapshot));
  map.permissions = permissions;
}

void System::SetSnapshot(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot) {
  const std::scoped_lock lock(mutex_);
  KnownMap* const map = state_.FindMap(key);
  if (map != nullptr && map->Exists() && key != state_.active_key) map->SetSnapshot(std::move(snapshot));
}

bool System::ReplaceSnapshot(std::uint64_t key, const std::shared_ptr<const MapSnapshot>& expected,
                             std::shared_ptr<const MapSnapshot> snapshot) {
  const std::scoped_lock lock(mutex_);
  const auto found = state_.maps.find(key);
  if (found == state_.maps.end() || policy_.IsUsed(key) || found->second.snapshot != expected) return false;
  index_.SetMap(key, snapshot);
  found->second.SetSnapshot(std::move(snapshot));
  return true;
}

void System::SetPermissions(std::uint64_t key, const MapPermissions& permissions) {
  const std::scoped_lock lock(mutex_);
  if (const auto found = state_.maps.find(key); found != state_.maps.end())
    found->second.permissions = permissions;
}

void System::StartMap(std::uint64_t key, std::size_t camera) {
  const std::scoped_lock lock(mutex_);
  policy_.StartMap(key, camera, false);
}

void System::EnterMap(std::uint64_t key, std::size_t camera) {
  const std::scoped_lock lock(mutex_);
  policy_.EnterMap(key, camera);
}

void System::LeaveMap(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  policy_.LeaveMap(key);
}

void System::JoinIntoActiveMap(std::uint64_t from) {
  const std::scoped_lock lock(mutex_);
  KnownMap* const other = state_.FindMap(from);
  const KnownMap* const into = state_.FindMap(state_.active_key);
  if (other != nullptr && into != nullptr && other != into) policy_.joins().Request(other, *into);
}

void System::RemoveMap(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  policy_.LeaveMap(key);
  index_.RemoveMap(key);
  // Late updates of the mapper are ignored.
  if (KnownMap* const map = state_.FindMap(key)) map->Discard();
}

void System::Activate(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  policy_.Activate(state_.maps.at(key));
}

std::uint64_t System::CurrentMap(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  return state_.cameras.at(camera).assignment.map();
}

std::uint64_t System::ActiveMap() const {
  const std::scoped_lock lock(mutex_);
  return state_.active_key;
}

std::vector<std::uint64_t> System::MapsInUse() const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::uint64_t> keys;
  for (const SystemCamera& camera : state_.cameras) keys.push_back(camera.assignment.map());
  return keys;
}

bool System::IsInUse(std::uint64_t key) const {
  const std::scoped_lock lock(mutex_);
  return policy_.IsUsed(key);
}

bool System::IsProvisional(std::uint64_t key) const {
  const std::scoped_lock lock(mutex_);
  const auto found = state_.maps.find(key);
  return found != state_.maps.end() && found->second.provisional.is_pending();
}

std::optional<RigEstimate> System::Rig() const {
  const std::scoped_lock lock(mutex_);
  return state_.rig.estimate();
}

CalibrationMonitor::Profile System::RadialErrors(std::size_t camera) const {
  const std::scoped_lock lock(mutex_);
  return state_.cameras.at(camera).calibration_monitor->profile();
}

std::vector<SystemEvent> System::TakeEvents() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(state_.events, {});
}

}  // namespace docent::engine
