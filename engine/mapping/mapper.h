// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "engine/mapping/calibration/lens_estimation.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/mapping/loops/loop_closing.h"
#include "engine/mapping/loops/map_joining.h"
#include "engine/mapping/mapper_event.h"
#include "engine/mapping/mapper_options.h"
#include "engine/mapping/points/map_descriptors.h"

namespace docent::engine {

// CPU seconds by task.
struct MapperTimes {
  double bundle_adjustment = 0, panorama_localization = 0, infinite_triangulation = 0, loop_closing = 0,
         other = 0;
  int loops_closed = 0;
  double max_queue_latency = 0;  // seconds; longest time that one step delayed an offered keyframe
};

// Extends and refines one map (ptamm §2.3, Fig. 2b): initializes it from two views, inserts keyframes,
// creates points, adjusts, and matches points in existing keyframes. Step() does the work, on one thread at a
// time; Offer(), Report(), Snapshot() and the other queries may be called from any thread. Long adjustments
// stop when a keyframe is offered.
class Mapper {
 public:
  explicit Mapper(const MapperOptions& options);

  // Continues with a map of the library, or with an empty map (null). Discards the queue. Must not be called
  // during a Step().
  void Adopt(std::shared_ptr<const MapSnapshot> snapshot);
  // Joins another map with the current one if both show one place (map_joining.h). The current map keeps its
  // ids and coordinates, and the queue remains. Nothing changes if the result has no `joined` map. Takes
  // seconds; must not be called during a Step(). interrupt may be null.
  MapJoinAttempt Join(const MapSnapshot& other, const std::atomic<bool>* interrupt);

  // Both return false if the queue is full. The times of the keyframes of one map ascend.
  bool Offer(KeyFrameCandidate candidate);
  bool Start(InitialPair pair);
  void Report(std::vector<PointReport> reports);
  std::size_t QueueLength() const;

  // Does the most urgent task; false if there was none.
  bool Step();
  // True if nothing urgent waits: no keyframe is queued, and the newest one is adjusted.
  bool IsIdle() const;

  // The last published state; null while there is no map.
  std::shared_ptr<const MapSnapshot> Snapshot() const;
  std::vector<MapperEvent> TakeEvents();
  MapperTimes Times() const;
  // The estimated lenses of the newest snapshot, in the order of MapperOptions::lens.
  std::vector<EstimatedLens> Lenses() const;

 private:
  using Task = std::variant<KeyFrameCandidate, InitialPair>;

  // A dependent panorama keyframe that is not localized yet, and the number of finite points at the last
  // attempt.
  struct Unlocalized {
    KeyFrameId keyframe = kNoId;
    std::size_t tried_with_points = 0;
    bool appearance_due = false;  // active search failed, and descriptor matching has not been tried since
  };

  void ResumeFrom(const MapSnapshot* snapshot);
  void EndWork(double seconds, double MapperTimes::*account);
  double MapperTimes::*DoNextTask();
  void StartMap(const InitialPair& pair);
  void StartFromPanorama(const KeyFrameCandidate& candidate);
  void InsertKeyFrame(const KeyFrameCandidate& candidate);
  void InsertSixDof(const KeyFrameCandidate& candidate, Map::KeyFrameRecord* record);
  void InsertPanorama(const KeyFrameCandidate& candidate);
  // Both try to localize one panorama keyframe: LocalizeNew one that was never tried, LocalizeAgain one of
  // the others. They return false if there is none worth trying.
  bool LocalizeNew();
  bool LocalizeAgain();
  void TryToLocalize(Unlocalized* waiting, std::size_t finite);
  std::size_t CountFinite() const;
  // guess: see LocalizePanoramaKeyFrame.
  bool Localize(KeyFrameId keyframe, const Rigid3* guess);
  // Triangulates the infinite points of one pair of keyframes; false if no pair waits.
  bool ConvertOne();
  void PlanConversions(KeyFrameId keyframe);
  bool IsFinite() const;  // the map has finite points
  void ApplyReports();
  std::vector<KeyFrameId> Partners(KeyFrameId keyframe);
  void MatchNewPoints();
  void LocalAdjustment();
  void GlobalAdjustment();
  // Does the most urgent step of lens estimation; false if there is none.
  bool EstimateLenses();
  // Adds an event if a given calibration contradicts the map.
  void CheckGivenCalibrations();
  // Does the most urgent step towards closing a loop; false if there is none.
  bool WorkOnLoops();
  void StoreImages(Task* task) const;
  // The candidate with the corrections applied that the map received since the pose was estimated.
  KeyFrameCandidate WithCorrections(KeyFrameCandidate candidate) const;
  void CullRedundantKeyFrame();  // removes one redundant keyframe
  void Publish();
  template <typename What>
  void AddEvent(Timestamp time, What what) {
    const std::lock_guard lock(mutex_);
    events_.push_back({time, std::move(what)});
  }

  const MapperOptions options_;
  // The members down to the atomics are used by the stepping thread only.
  Map map_;
  PointSearcher searcher_;
  MapDescriptors descriptors_;
  KeyFrameId newest_ = kNoId;
  std::vector<MapPointId> to_match_;
  std::vector<Unlocalized> to_localize_;
  std::deque<std::pair<KeyFrameId, KeyFrameId>> to_convert_;  // (reference, partner)
  LoopCloser loops_;
  LensEstimation lens_estimation_;
  bool loop_to_adjust_ = false;  // the next global adjustment follows a loop
  std::size_t keyframes_since_global_ = 0;
  bool global_interrupted_ = false;  // a global adjustment was interrupted, or is due for another reason
  bool culling_due_ = false;         // the map was adjusted since keyframes were last checked for redundancy

  std::atomic<bool> interrupt_{false};
  std::atomic<bool> locally_adjusted_{true};
  mutable std::mutex mutex_;  // guards the members below; held only while pointers and small lists are copied
  std::deque<Task> queue_;
  std::optional<std::chrono::steady_clock::time_point> offered_during_step_;
  bool stepping_ = false;
  std::vector<PointReport> reports_;
  std::shared_ptr<const MapSnapshot> snapshot_;
  std::vector<MapperEvent> events_;
  std::vector<EstimatedLens> lenses_;
  MapperTimes times_;
};

}  // namespace docent::engine
