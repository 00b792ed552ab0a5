// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/map_refinement.h"

#include <algorithm>
#include <set>
#include <utility>

#include "engine/map/map_readout.h"
#include "engine/mapping/bundle/map_assembly.h"
#include "engine/mapping/calibration/readout_calibration.h"

namespace docent::engine {

void MapRefinement::Reset() {
  Forget();
  newest_ = kNoId;
  global_due_ = culling_due_ = loop_to_adjust_ = false;
  locally_adjusted_ = true;
}

void MapRefinement::Forget() {
  to_adjust_.clear();
  workspace_->map.SetFirstUnadjusted(kNoId);
  to_match_.clear();
  keyframes_since_global_ = 0;
}

void MapRefinement::AddKeyFrame(KeyFrameId keyframe) {
  to_adjust_.push_back(keyframe);
  workspace_->map.SetFirstUnadjusted(FirstToAdjust());
  AddLocalized(keyframe);
}

void MapRefinement::AddLocalized(KeyFrameId keyframe) {
  newest_ = keyframe;
  ++keyframes_since_global_;
  locally_adjusted_ = false;
}

void MapRefinement::AddPoints(std::span<const MapPointId> points) {
  to_match_.insert(to_match_.end(), points.begin(), points.end());
}

bool MapRefinement::NeedsGlobalAdjustment() const {
  return global_due_ || keyframes_since_global_ > 4 + workspace_->map.keyframes().size() / 6;
}

void MapRefinement::MatchNewPoints() {
  constexpr std::size_t kNeighbours = 8;
  std::vector<KeyFrameId> sources = to_adjust_;
  if (sources.empty() && newest_ != kNoId) sources.push_back(newest_);
  std::set<KeyFrameId> searched;
  for (const KeyFrameId source : sources) {
    auto neighbours = workspace_->map.Covisible(source);
    if (neighbours.size() > kNeighbours) neighbours.resize(kNeighbours);
    for (const auto& [id, shared] : neighbours) {
      if (searched.insert(id).second)
        MatchMapPoints(options_.guided_matching, id, &workspace_->searcher, &workspace_->map, &to_match_);
    }
  }
  to_match_.clear();
}

void MapRefinement::AdjustAroundNewest() {
  Map& map = workspace_->map;
  const KeyFrameId keyframe = NewestToAdjust();
  // The adjustment removes observations, on which the window depends.
  const std::set<KeyFrameId> adjusted = KeyFramesAround(options_.adjustment.window, keyframe, &map);
  const std::atomic<bool>* const interrupt = IsAdjustmentOverdue() ? nullptr : interrupt_;
  const BundleSummary summary = AdjustLocally(options_.adjustment, keyframe, interrupt, &map);
  if (summary.outcome != BundleSummary::Outcome::kInterrupted) {
    std::erase_if(to_adjust_, [&](KeyFrameId waiting) { return adjusted.contains(waiting); });
    locally_adjusted_ = to_adjust_.empty();
    AdjustToReadout(keyframe);
    map.SetFirstUnadjusted(FirstToAdjust());
  }
  output_->Publish(map.Snapshot());
}

std::vector<MapRefinement::KnownReadout>::iterator MapRefinement::FindKnownReadout(const CameraModel& lens) {
  return std::ranges::find_if(known_readouts_,
                              [&](const KnownReadout& known) { return known.lens->HasSameLens(lens); });
}

void MapRefinement::SetReadoutPrior(const std::optional<ReadoutPrior>& prior,
                                    std::shared_ptr<const CameraModel> lens) {
  const auto known = FindKnownReadout(*lens);
  if (known != known_readouts_.end()) known_readouts_.erase(known);
  if (prior) known_readouts_.push_back({std::move(lens), *prior});
}

bool MapRefinement::AdjustToReadout(KeyFrameId keyframe) {
  if (!UpdateReadoutOf(keyframe)) return false;
  // Until it is done, poses and points do not fit the new readout time: where it was interrupted, a simulated
  // camera was 4 to 7 cm off for up to 26 images.
  constexpr std::atomic<bool>* kNotInterrupted = nullptr;
  AdjustLocally(options_.adjustment, keyframe, kNotInterrupted, &workspace_->map);
  RequireGlobalAdjustment();
  return true;
}

void MapRefinement::EstimateReadout(const TrackedCorners& corners) {
  const bool known = FindKnownReadout(*corners.camera) != known_readouts_.end();
  if (!MayEstimateReadout() || known || !ReadoutIn(workspace_->map, *corners.camera)) return;
  const auto estimate = EstimateTrackReadout(options_.track_readout, *corners.camera, corners.sequence);
  const auto prior = estimate ? SignificantReadout(options_.track_readout, *estimate) : std::nullopt;
  if (!prior) return;
  SetReadoutPrior(prior, corners.camera);
  if (AdjustToReadout(newest_)) output_->Publish(workspace_->map.Snapshot());
}

bool MapRefinement::UpdateReadoutOf(KeyFrameId keyframe) {
  const Map::KeyFrameRecord* record = workspace_->map.FindKeyFrame(keyframe);
  if (!MayEstimateReadout() || !record) return false;
  const std::shared_ptr<const CameraModel> camera = record->keyframe.camera;
  ReadoutEstimationOptions options = options_.readout;
  const auto known = FindKnownReadout(*camera);
  if (known != known_readouts_.end()) options.prior = known->prior;
  const ReadoutCalibration result =
      CalibrateReadout(options, options_.adjustment, keyframe, &workspace_->map);
  // Without the corners, it may be an error of the calibration that the next keyframes reveal.
  if (result.estimate && options.prior) SetReadoutPrior(result.estimate, camera);
  return result.changed;
}

void MapRefinement::AdjustWholeMap() {
  // The global adjustment has the highest memory use of all tasks.
  workspace_->searcher.Release();
  if (options_.images) options_.images->EvictAll();
  MapAdjustmentOptions adjustment = options_.adjustment;
  if (loop_to_adjust_) adjustment.global_loss = RobustLoss::kHuber;
  Map& map = workspace_->map;
  const BundleSummary summary = AdjustGlobally(adjustment, interrupt_, &map);
  global_due_ = summary.outcome == BundleSummary::Outcome::kInterrupted;
  if (global_due_) return;
  // The remaining error of a loop takes several adjustments: rounds with Huber's loss while the cost
  // decreases considerably, then one with the standard loss. Switching too early would reject the
  // observations at the seam as outliers and open the loop again.
  constexpr double kMaxCostRatio = 0.9;
  global_due_ = std::exchange(loop_to_adjust_,
                              loop_to_adjust_ && summary.final_cost < kMaxCostRatio * summary.initial_cost);
  keyframes_since_global_ = 0;
  culling_due_ = true;
  output_->Publish(map.Snapshot());
  if (!map.empty()) output_->AddEvent(workspace_->NewestTime(), MapperEvent::GloballyAdjusted{summary});
}

void MapRefinement::CullRedundantKeyFrame() {
  Map& map = workspace_->map;
  const KeyFrameId redundant = FindRedundantKeyFrame(options_.culling, newest_, &map);
  culling_due_ = redundant != kNoId;
  if (!culling_due_) return;
  const Timestamp time = map.FindKeyFrame(redundant)->keyframe.time;
  CullKeyFrame(redundant, &map);
  workspace_->searcher.Clear();
  output_->Publish(map.Snapshot());
  output_->AddEvent(time, MapperEvent::KeyFrameRemoved{redundant});
}

}  // namespace docent::engine
