// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/geometry/triangulation.h"

namespace docent::engine {

namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// CPU time of this thread, so that other processes do not distort it.
double ProcessorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Mapper::Mapper(const MapperOptions& options)
    : options_(Checked(options)),
      searcher_(options.search),
      descriptors_(DefaultVocabulary()),
      loops_(options.loops, options.search),
      lens_estimation_(options.lens),
      lenses_(options.lens.lenses) {}

// Resets the state of the stepping thread to a map; the queue is not changed.
void Mapper::ResumeFrom(const MapSnapshot* snapshot) {
  map_ = snapshot ? Map(*snapshot) : Map();
  searcher_.Clear();
  descriptors_.Clear();
  newest_ = kNoId;
  to_match_.clear();
  to_localize_.clear();
  to_convert_.clear();
  loops_.Reset();
  lens_estimation_.Reset();
  for (const auto& [id, record] : map_.keyframes()) {
    if (record.keyframe.kind == KeyFrameKind::kPanorama) to_localize_.push_back({id});
  }
  keyframes_since_global_ = 0;
  global_interrupted_ = culling_due_ = false;
  loop_to_adjust_ = false;
  locally_adjusted_ = true;
}

void Mapper::Adopt(std::shared_ptr<const MapSnapshot> snapshot) {
  ResumeFrom(snapshot.get());
  const std::lock_guard lock(mutex_);
  queue_.clear();
  reports_.clear();
  snapshot_ = std::move(snapshot);
}

MapJoinAttempt Mapper::Join(const MapSnapshot& other, const std::atomic<bool>* interrupt) {
  const double start = ProcessorSeconds();
  {
    const std::lock_guard lock(mutex_);
    stepping_ = true;
  }
  // Frees memory as before a global adjustment, since this one involves two maps.
  searcher_.Release();
  if (options_.images) options_.images->EvictAll();
  MapJoinAttempt attempt = JoinMaps(options_.joining, *map_.Snapshot(), other, interrupt);
  if (attempt.joined) ResumeFrom(attempt.joined->map.get());
  EndWork(ProcessorSeconds() - start, &MapperTimes::other);
  if (attempt.joined) {
    const std::lock_guard lock(mutex_);
    snapshot_ = attempt.joined->map;
  }
  return attempt;
}

bool Mapper::Offer(KeyFrameCandidate candidate) {
  const std::lock_guard lock(mutex_);
  if (queue_.size() >= options_.max_queue) return false;
  queue_.emplace_back(std::move(candidate));
  if (stepping_ && !offered_during_step_) offered_during_step_ = std::chrono::steady_clock::now();
  interrupt_ = true;
  return true;
}

bool Mapper::Start(InitialPair pair) {
  const std::lock_guard lock(mutex_);
  if (queue_.size() >= options_.max_queue) return false;
  queue_.emplace_back(std::move(pair));
  if (stepping_ && !offered_during_step_) offered_during_step_ = std::chrono::steady_clock::now();
  interrupt_ = true;
  return true;
}

void Mapper::Report(std::vector<PointReport> reports) {
  const std::lock_guard lock(mutex_);
  reports_.insert(reports_.end(), reports.begin(), reports.end());
}

std::size_t Mapper::QueueLength() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

std::shared_ptr<const MapSnapshot> Mapper::Snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

std::vector<MapperEvent> Mapper::TakeEvents() {
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

MapperTimes Mapper::Times() const {
  const std::lock_guard lock(mutex_);
  return times_;
}

std::vector<EstimatedLens> Mapper::Lenses() const {
  const std::lock_guard lock(mutex_);
  return lenses_;
}

bool Mapper::IsIdle() const {
  return QueueLength() == 0 && locally_adjusted_;
}

void Mapper::Publish() {
  auto snapshot = map_.Snapshot();
  const std::lock_guard lock(mutex_);
  snapshot_ = std::move(snapshot);
}

bool Mapper::Step() {
  const double start = ProcessorSeconds();
  std::optional<Task> task;
  {
    const std::lock_guard lock(mutex_);
    if (!queue_.empty()) {
      task = std::move(queue_.front());
      queue_.pop_front();
    }
    interrupt_ = !queue_.empty();
    stepping_ = true;
  }
  double MapperTimes::*account = &MapperTimes::other;
  if (task) {
    StoreImages(&*task);
    if (const auto* candidate = std::get_if<KeyFrameCandidate>(&*task)) {
      InsertKeyFrame(WithCorrections(*candidate));
    } else {
      StartMap(std::get<InitialPair>(*task));
    }
  } else {
    account = DoNextTask();
  }
  EndWork(ProcessorSeconds() - start, account);
  return account != nullptr;
}

// account: null if there was nothing to do.
void Mapper::EndWork(double seconds, double MapperTimes::*account) {
  const std::lock_guard lock(mutex_);
  stepping_ = false;
  if (offered_during_step_)
    times_.max_queue_latency = std::max(times_.max_queue_latency, SecondsSince(*offered_during_step_));
  offered_during_step_.reset();
  if (account != nullptr) times_.*account += seconds;
}

// Does the most urgent task apart from queued keyframes. Returns the account for its time; null if there was
// none.
double MapperTimes::*Mapper::DoNextTask() {
  if (!to_match_.empty()) {
    MatchNewPoints();
    return &MapperTimes::other;
  }
  if (!locally_adjusted_) {
    LocalAdjustment();
    return &MapperTimes::bundle_adjustment;
  }
  if (loops_.HasLoop() && WorkOnLoops()) return &MapperTimes::loop_closing;
  if (EstimateLenses()) return &MapperTimes::bundle_adjustment;
  // New points keep the camera tracked, so they come before keyframes that could not be localized so far.
  if (LocalizeNew()) return &MapperTimes::panorama_localization;
  if (ConvertOne()) return &MapperTimes::infinite_triangulation;
  if (LocalizeAgain()) return &MapperTimes::panorama_localization;
  if (global_interrupted_ || keyframes_since_global_ > 4 + map_.keyframes().size() / 6) {
    GlobalAdjustment();
    return &MapperTimes::bundle_adjustment;
  }
  if (culling_due_) {
    CullRedundantKeyFrame();
    return &MapperTimes::other;
  }
  if (WorkOnLoops()) return &MapperTimes::loop_closing;
  CheckGivenCalibrations();
  return nullptr;
}

bool Mapper::IsFinite() const {
  return std::any_of(map_.points().begin(), map_.points().end(),
                     [](const Map::PointRecord& record) { return record.alive && !record.point.infinite(); });
}

void Mapper::ApplyReports() {
  constexpr int kMinTries = 20;
  std::vector<PointReport> reports;
  {
    const std::lock_guard lock(mutex_);
    reports.swap(reports_);
  }
  for (const PointReport& report : reports) {
    Map::PointRecord* record = map_.FindPoint(report.point);
    if (!record) continue;
    record->seen_inlier += report.inlier;
    record->seen_outlier += report.outlier;
    record->not_found += report.not_found;
    const int tries = record->seen_inlier + record->seen_outlier + record->not_found;
    // Points that are mostly matched in the wrong place, or never beyond their first two views, harm
    // tracking.
    const bool wrong = record->seen_outlier > kMinTries && record->seen_outlier > record->seen_inlier;
    const std::size_t first_views = record->point.infinite() ? 1 : 2;
    const bool unconfirmed =
        tries > kMinTries && record->observers.size() <= first_views && record->seen_inlier * 5 < tries;
    if (wrong || unconfirmed) map_.RemovePoint(report.point);
  }
}

void Mapper::InsertKeyFrame(const KeyFrameCandidate& candidate) {
  if (candidate.choice == KeyFrameChoice::kFirst) {
    if (map_.empty()) StartFromPanorama(candidate);
    return;
  }
  if (map_.empty()) return;
  ApplyReports();
  if (candidate.choice == KeyFrameChoice::kPanorama) {
    InsertPanorama(candidate);
    return;
  }
  KeyFrame keyframe;
  keyframe.time = candidate.time;
  keyframe.camera = candidate.camera;
  keyframe.features = candidate.features;
  keyframe.camera_from_map = candidate.camera_from_map;
  InsertSixDof(candidate, &map_.AddKeyFrame(keyframe));
}

void Mapper::InsertSixDof(const KeyFrameCandidate& candidate, Map::KeyFrameRecord* record) {
  const KeyFrameId id = record->keyframe.id;
  for (const PointMatch& match : candidate.matches) {
    const Map::PointRecord* point = map_.FindPoint(match.point);
    if (point && !point->point.infinite()) map_.AddObservation({id, match.point, match.pixel, match.level});
  }
  map_.UpdateDepth(record);
  MatchMapPoints(options_.guided_matching, id, &searcher_, &map_);
  map_.UpdateDepth(record);
  std::vector<MapPointId> created;
  for (const KeyFrameId partner : Partners(id)) {
    const auto points = CreatePoints(options_.creation, id, partner, &map_, &searcher_);
    created.insert(created.end(), points.begin(), points.end());
  }
  to_match_.insert(to_match_.end(), created.begin(), created.end());
  int rays = 0;
  if (candidate.choice == KeyFrameChoice::kLocalizedPanorama) {
    map_.OpenPanorama(id);
    rays = AddInfinitePoints(options_.infinite, id, {}, &map_);
  }
  PlanConversions(id);
  newest_ = id;
  loops_.Enqueue(id);
  ++keyframes_since_global_;
  locally_adjusted_ = false;
  Publish();
  if (candidate.choice == KeyFrameChoice::kLocalizedPanorama) {
    AddEvent(candidate.time, MapperEvent::PanoramaOpened{rays});
  } else {
    AddEvent(candidate.time, MapperEvent::KeyFrameAdded{created.size(), map_.AlivePoints()});
  }
}

std::vector<KeyFrameId> Mapper::Partners(KeyFrameId id) {
  const Map::KeyFrameRecord& record = *map_.FindKeyFrame(id);
  const Eigen::Vector3d center = record.keyframe.camera_from_map.OriginInSource();
  struct Scored {
    double score;
    KeyFrameId id;
  };
  std::vector<Scored> scored;
  for (const auto& [other, shared] : map_.Covisible(id)) {
    if (shared < 15) break;
    const Rigid3& pose = map_.FindKeyFrame(other)->keyframe.camera_from_map;
    const double baseline = (pose.OriginInSource() - center).norm() / record.keyframe.mean_depth;
    if (baseline < options_.min_partner_baseline || baseline > options_.max_partner_baseline) continue;
    // Large overlap helps matching; a baseline of about 0.15 depths helps triangulation.
    const double fit = std::min(baseline / 0.15, 0.15 / baseline);
    scored.push_back({-shared * std::sqrt(fit), other});
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const Scored& a, const Scored& b) { return a.score < b.score; });
  std::vector<KeyFrameId> partners;
  for (const Scored& partner : scored) {
    if (static_cast<int>(partners.size()) >= options_.partners) break;
    partners.push_back(partner.id);
  }
  return partners;
}

void Mapper::StoreImages(Task* task) const {
  if (!options_.images) return;
  const auto keep = [this](std::shared_ptr<const ImageFeatures>* features) {
    *features = options_.images->Store(std::move(*features));
  };
  if (auto* candidate = std::get_if<KeyFrameCandidate>(task)) {
    keep(&candidate->features);
    return;
  }
  auto& pair = std::get<InitialPair>(*task);
  keep(&pair.a.features);
  keep(&pair.b.features);
}

void Mapper::MatchNewPoints() {
  // New points are searched in the keyframes that share most points with the newest one.
  constexpr std::size_t kNeighbours = 8;
  if (newest_ != kNoId) {
    auto neighbours = map_.Covisible(newest_);
    if (neighbours.size() > kNeighbours) neighbours.resize(kNeighbours);
    for (const auto& [id, shared] : neighbours)
      MatchMapPoints(options_.guided_matching, id, &searcher_, &map_, &to_match_);
  }
  to_match_.clear();
}

void Mapper::LocalAdjustment() {
  const BundleSummary summary = AdjustLocally(options_.adjustment, newest_, &interrupt_, &map_);
  if (summary.outcome != BundleSummary::Outcome::kInterrupted) locally_adjusted_ = true;
  Publish();
}

// The check never changes the map, so lockstep runs do not depend on whether it was finished.
void Mapper::CheckGivenCalibrations() {
  if (map_.keyframes().empty()) return;
  if (const auto contradiction = lens_estimation_.Check(&interrupt_, map_))
    AddEvent(map_.keyframes().rbegin()->second.keyframe.time,
             MapperEvent::CalibrationContradicted{*contradiction});
}

bool Mapper::EstimateLenses() {
  const LensEstimation::Progress progress = lens_estimation_.Step(&searcher_, &interrupt_, &map_);
  if (progress == LensEstimation::Progress::kNothing) return false;
  if (progress == LensEstimation::Progress::kStepDone) return true;
  if (progress == LensEstimation::Progress::kMapChanged) {
    searcher_.Clear();
    global_interrupted_ = true;
  }
  {
    const std::lock_guard lock(mutex_);
    lenses_ = lens_estimation_.lenses();
  }
  // The lenses are set first, so that a snapshot is never published with older ones.
  if (progress == LensEstimation::Progress::kMapChanged) Publish();
  AddEvent(map_.keyframes().rbegin()->second.keyframe.time, MapperEvent::LensesEstimated{});
  return true;
}

void Mapper::GlobalAdjustment() {
  // The global adjustment has the highest memory use of all tasks.
  searcher_.Release();
  if (options_.images) options_.images->EvictAll();
  MapAdjustmentOptions adjustment = options_.adjustment;
  if (loop_to_adjust_) adjustment.global_loss = RobustLoss::kHuber;
  const BundleSummary summary = AdjustGlobally(adjustment, &interrupt_, &map_);
  global_interrupted_ = summary.outcome == BundleSummary::Outcome::kInterrupted;
  if (global_interrupted_) return;
  // The remaining error of a loop takes several adjustments: rounds with Huber's loss while the cost
  // decreases considerably, then one with the standard loss. Switching too early would reject the
  // observations at the seam as outliers and open the loop again.
  constexpr double kMaxCostRatio = 0.9;
  global_interrupted_ = std::exchange(
      loop_to_adjust_, loop_to_adjust_ && summary.final_cost < kMaxCostRatio * summary.initial_cost);
  keyframes_since_global_ = 0;
  culling_due_ = true;
  Publish();
  if (map_.empty()) return;
  AddEvent(map_.keyframes().rbegin()->second.keyframe.time, MapperEvent::GloballyAdjusted{summary});
}

void Mapper::CullRedundantKeyFrame() {
  const KeyFrameId redundant = FindRedundantKeyFrame(options_.culling, newest_, &map_);
  culling_due_ = redundant != kNoId;
  if (!culling_due_) return;
  const Timestamp time = map_.FindKeyFrame(redundant)->keyframe.time;
  CullKeyFrame(redundant, &map_);
  searcher_.Clear();
  Publish();
  AddEvent(time, MapperEvent::KeyFrameRemoved{redundant});
}

}  // namespace docent::engine
