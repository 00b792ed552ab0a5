// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "engine/mapping/keyframe_insertion.h"
#include "engine/mapping/loops/map_joining.h"
#include "engine/mapping/map_creation.h"
#include "engine/mapping/mapper_queue.h"

namespace docent::engine {

// Extends and refines one map (ptamm §2.3, Fig. 2b): decides which of its tasks is the most urgent, from
// offered keyframes down to the search for loops. Step() does the work, on one thread at a time; Offer(),
// Report(), Snapshot() and the other queries may be called from any thread. Long adjustments stop when a
// keyframe is offered.
class Mapper {
 public:
  explicit Mapper(const MapperOptions& options);

  // Continues with a map of the library, or with an empty map (null). Discards the queue. Must not be called
  // during a Step().
  void Adopt(std::shared_ptr<const MapSnapshot> snapshot);
  // Another map is about to be adopted: ends a long adjustment of the current one early. From any thread.
  void Interrupt() { queue_.Interrupt(); }
  // Joins another map with the current one if both show one place (map_joining.h). The current map keeps its
  // ids and coordinates, and the queue remains. Nothing changes if the result has no `joined` map. Takes
  // seconds; must not be called during a Step(). interrupt may be null.
  MapJoinAttempt Join(const MapSnapshot& other, const std::atomic<bool>* interrupt);
  // The same once the other map has been compared with this one, in a state from which the comparison still
  // applies. The adjustment is left to later steps, which a keyframe interrupts.
  MapJoinAttempt Join(const MapComparison& comparison, const std::atomic<bool>* interrupt);
  bool StillApplies(const MapComparison& comparison) const {
    return engine::StillApplies(options_.joining, comparison, *Snapshot());
  }
  // Whether a join would interrupt no task: new keyframes and points would miss their local adjustment, and
  // a loop would not be closed.
  bool MayJoin() const {
    return refinement_.IsLocallyAdjusted() && !refinement_.HasNewPoints() && !loops_.HasLoop();
  }
  // The remaining error of a loop or a join is yet to be adjusted. A map that is adopted again needs it
  // still.
  bool HasLoopToAdjust() const { return refinement_.HasLoopToAdjust(); }
  void RequireAdjustmentOfLoop() { refinement_.RequireAdjustmentOfLoop(); }

  // They return false if the queue is full. The times of the keyframes of one map ascend.
  bool Offer(KeyFrameCandidate candidate) { return queue_.Offer(std::move(candidate)); }
  bool Start(InitialPair pair) { return queue_.Offer(std::move(pair)); }
  // Corners of images before the map knew the readout time of their camera.
  bool Offer(TrackedCorners corners) { return queue_.Offer(std::move(corners)); }
  void Report(std::vector<PointReport> reports) { queue_.Report(std::move(reports)); }
  std::size_t QueueLength() const { return queue_.Length(); }

  // Does the most urgent task; false if there was none.
  bool Step();
  // True if nothing urgent waits: no keyframe is queued, and those that were added are adjusted locally.
  bool IsIdle() const { return QueueLength() == 0 && refinement_.IsLocallyAdjusted(); }

  // The last published state; null while there is no map.
  std::shared_ptr<const MapSnapshot> Snapshot() const { return output_.Snapshot(); }
  std::vector<MapperEvent> TakeEvents() { return output_.TakeEvents(); }
  MapperTimes Times() const { return output_.Times(); }
  // The estimated lenses of the newest snapshot, in the order of MapperOptions::lens.
  std::vector<EstimatedLens> Lenses() const { return output_.Lenses(); }

 private:
  // Fixes the poses of the keyframes that the map has now.
  void FixKeyFrames();
  // Removes the oldest temporary keyframes above their largest number (FindOldestKeyFrame).
  void RemoveOldTemporaryKeyFrames();
  // Resets the state of the thread that runs the mapper to a map; the queue is not changed.
  void ResumeFrom(const MapSnapshot* snapshot);
  void Serve(MapperQueue::Request request);
  // Does the most urgent task apart from queued keyframes. Returns the account for its time; null if there
  // was none.
  double MapperTimes::*DoNextTask();
  // Does the most urgent step of lens estimation; false if there is none.
  bool EstimateLenses();
  // Adds an event if a given calibration contradicts the map.
  void CheckGivenCalibrations();
  // Does the most urgent step towards closing a loop; false if there is none.
  bool WorkOnLoops();

  const MapperOptions options_;
  MapperQueue queue_;
  MapperOutput output_;
  // The members below are used by the thread that runs the mapper only, and each uses those above it.
  MapWorkspace workspace_;
  LoopCloser loops_;
  LensEstimation lens_estimation_;
  MapRefinement refinement_;
  PanoramaMapper panoramas_;
  KeyFrameInsertion insertion_;
  MapCreation creation_;
};

}  // namespace docent::engine
