// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/initialization/corner_sequence.h"
#include "engine/mapping/map_workspace.h"
#include "engine/mapping/mapper_options.h"
#include "engine/mapping/mapper_output.h"

namespace docent::engine {

// The mapper's tasks that improve a map without extending it: searching new points in earlier keyframes,
// local and global bundle adjustment, and culling of keyframes. It remembers which of them is due. On the
// thread that runs the mapper only, apart from IsLocallyAdjusted.
class MapRefinement {
 public:
  // The pointers are borrowed. An adjustment stops when *interrupt becomes true, and remains due.
  MapRefinement(const MapperOptions& options, const std::atomic<bool>* interrupt, MapWorkspace* workspace,
                MapperOutput* output)
      : options_(options), interrupt_(interrupt), workspace_(workspace), output_(output) {}

  // Another map, or this one joined with another: nothing is due, and no keyframe is the newest. Readout
  // times that were estimated from corners remain.
  void Reset();
  // Another map: readout times that were estimated from corners are dropped too.
  void ForgetReadouts() { known_readouts_.clear(); }
  // Drops what refers to keyframes and points of a map that is being replaced.
  void Forget();
  // The keyframe about which the next local tasks are done; kNoId for none.
  void SetNewest(KeyFrameId keyframe) { newest_ = keyframe; }
  // A keyframe with a known position was added. It waits for its local adjustment, even if others follow.
  void AddKeyFrame(KeyFrameId keyframe);
  // A panorama keyframe was localized. It waits for its local adjustment until a keyframe is added.
  void AddLocalized(KeyFrameId keyframe);
  // New points, to be searched in earlier keyframes.
  void AddPoints(std::span<const MapPointId> points);
  void SetLocallyAdjusted() { locally_adjusted_ = true; }
  // The next idle step adjusts the whole map.
  void RequireGlobalAdjustment() { global_due_ = true; }
  // The same, with the loss for the remaining error of a loop.
  void RequireAdjustmentOfLoop() { global_due_ = loop_to_adjust_ = true; }

  // True unless keyframes wait for their local adjustment. From any thread.
  bool IsLocallyAdjusted() const { return locally_adjusted_; }
  // True once a second keyframe waits. Further ones have to wait then: in a fast motion one follows the
  // other, and no adjustment would ever be completed.
  bool IsAdjustmentOverdue() const { return to_adjust_.size() > 1; }
  bool HasNewPoints() const { return !to_match_.empty(); }
  // True until the remaining error of a loop was adjusted.
  bool HasLoopToAdjust() const { return loop_to_adjust_; }
  bool NeedsGlobalAdjustment() const;
  bool MayHaveRedundantKeyFrames() const { return culling_due_; }

  // Searches the new points in the keyframes that share most points with those that wait for their local
  // adjustment, or with the newest one.
  void MatchNewPoints();
  // Adjusts the newest of the waiting keyframes and those around it. The others in this window wait no
  // longer. Not interrupted if it is overdue.
  void AdjustAroundNewest();
  // The readout time of a lens that was estimated from the corners of the initialization.
  void SetReadoutPrior(const std::optional<ReadoutPrior>& prior, std::shared_ptr<const CameraModel> lens);
  // Estimates the readout time from corners unless it was before, and adjusts the map if it changes.
  void EstimateReadout(const TrackedCorners& corners);
  // Estimates the readout time of the newest keyframe's camera. True if it changed, so that the map has to be
  // adjusted.
  bool UpdateReadout() { return UpdateReadoutOf(newest_); }
  void AdjustWholeMap();
  // Removes one redundant keyframe if there is one.
  void CullRedundantKeyFrame();

 private:
  // The readout time of a lens, estimated from corners. It is a constant, so each estimate is the prior of
  // the next: in a fast pan the newest keyframes alone were wrong by 6 ms.
  struct KnownReadout {
    std::shared_ptr<const CameraModel> lens;
    ReadoutPrior prior;
  };
  // Whether the readout time may be estimated: the errors of a calibration that is not known yet look alike.
  bool MayEstimateReadout() const { return !options_.temporary && options_.lens.lenses.empty(); }
  std::vector<KnownReadout>::iterator FindKnownReadout(const CameraModel& lens);
  KeyFrameId FirstToAdjust() const { return to_adjust_.empty() ? kNoId : std::ranges::min(to_adjust_); }
  KeyFrameId NewestToAdjust() const { return to_adjust_.empty() ? newest_ : to_adjust_.back(); }
  bool UpdateReadoutOf(KeyFrameId keyframe);
  // Estimates the readout time and adjusts the map around this keyframe again if it changed, which is
  // returned.
  bool AdjustToReadout(KeyFrameId keyframe);
  const MapperOptions& options_;
  const std::atomic<bool>* const interrupt_;
  MapWorkspace* const workspace_;
  MapperOutput* const output_;
  KeyFrameId newest_ = kNoId;
  std::vector<KeyFrameId> to_adjust_;  // added and not adjusted locally yet, the newest last
  std::vector<KnownReadout> known_readouts_;
  std::vector<MapPointId> to_match_;
  std::atomic<bool> locally_adjusted_{true};
  bool loop_to_adjust_ = false;  // the next global adjustment follows a loop
  std::size_t keyframes_since_global_ = 0;
  bool global_due_ = false;   // a global adjustment was interrupted, or is due for another reason
  bool culling_due_ = false;  // the map was adjusted since keyframes were last checked for redundancy
};

}  // namespace docent::engine
