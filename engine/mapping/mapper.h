// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/mapping/guided_matching.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/mapping/keyframe_culling.h"
#include "engine/mapping/loop_closing.h"
#include "engine/mapping/map_adjustment.h"
#include "engine/mapping/map_descriptors.h"
#include "engine/mapping/map_joining.h"
#include "engine/mapping/panorama_mapping.h"
#include "engine/mapping/point_creation.h"
#include "engine/vision/image_store.h"

namespace docent::engine {

struct MapperOptions {
  std::size_t max_queue = 3;           // keyframes waiting (ptamm §2.2)
  double initial_baseline_m = 0.1;     // ptamm §2.3
  int partners = 3;                    // keyframes in which a new one's corners are looked for
  double min_partner_baseline = 0.03;  // of the mean depth
  double max_partner_baseline = 0.6;
  int min_initial_points = 60;  // after the first adjustment, else the start is given up
  GuidedMatchingOptions guided_matching;
  PointCreationOptions creation;
  InfinitePointOptions infinite;
  LocalizationOptions localization;
  AppearanceOptions appearance;
  KeyFrameCullingOptions culling;
  int min_initial_directions = 40;  // in the first image, for a map to begin as a panorama
  // Of the infinite points: what is seen from two panorama maps is mostly further away (hybrid-slam §5.2).
  double min_infinite_parallax_deg = 1.5;
  int conversion_partners = 30;  // keyframes in which a localized keyframe's infinite points are looked for
  MapAdjustmentOptions adjustment;
  LoopOptions loops;
  MapJoiningOptions joining;
  SearchOptions search;
  std::shared_ptr<ImageStore> images;  // where keyframes' images lie; null: in memory
};

// What the mapper did, for events and reports.
struct MapperEvent {
  enum class Kind {
    kMapStarted,
    kStartFailed,
    kKeyFrame,
    kPanoramaOpened,
    kPanoramaKeyFrame,
    kLocalized,
    kConverted,
    kKeyFrameRemoved,
    kGlobalAdjustment,
    kLoopClosed
  };
  Kind kind = Kind::kKeyFrame;
  Timestamp time{};
  std::string detail;
};

// Seconds of processor time by task.
struct MapperTimes {
  double bundle_adjustment = 0, panorama_localization = 0, infinite_triangulation = 0, loop_closing = 0,
         other = 0;
  int loops_closed = 0;
  double max_queue_latency = 0;  // for which a piece of work made an offered keyframe wait
};

// Grows and refines one map (ptamm §2.3, Fig. 2b): starts it from two views, takes keyframes in, makes
// points, adjusts, finds points again. Work is done by Step() on one thread at a time; Offer(), Report(),
// Snapshot() and the other questions may be asked from any thread. Long adjustments stop when a keyframe is
// offered.
class Mapper {
 public:
  explicit Mapper(const MapperOptions& options);

  // Goes on with a map from the library, or with nothing (null). Drops whatever waits. Not during a Step().
  void Adopt(std::shared_ptr<const MapSnapshot> snapshot);
  // Takes another map into the present one where both show one place (map_joining.h): this one keeps its ids
  // and coordinates, and what was offered waits on. Without `joined` in the answer nothing has changed. Takes
  // seconds; not during a Step(). interrupt may be null.
  MapJoinAttempt Join(const MapSnapshot& other, const std::atomic<bool>* interrupt);

  // False when the queue is full. Times of one map ascend.
  bool Offer(KeyFrameCandidate candidate);
  bool Start(InitialPair pair);
  void Report(std::vector<PointReport> reports);
  std::size_t QueueLength() const;

  // Does the most urgent piece of work; false when there was none.
  bool Step();
  // True while nothing urgent waits: no keyframe, and the newest one is adjusted.
  bool IsIdle() const;

  // The newest published state; null while there is no map.
  std::shared_ptr<const MapSnapshot> Snapshot() const;
  std::vector<MapperEvent> TakeEvents();
  MapperTimes Times() const;

 private:
  using Task = std::variant<KeyFrameCandidate, InitialPair>;

  // A dependent panorama keyframe that waits to be localized, and what the map knew when that was last tried.
  struct Unlocalized {
    KeyFrameId keyframe = kNoId;
    std::size_t tried_with_points = 0;
    bool appearance_due = false;  // active search failed; its looks have not been asked yet
  };

  void ResumeFrom(const MapSnapshot* snapshot);
  void EndWork(double seconds, double MapperTimes::*account);
  double MapperTimes::*DoNextTask();
  void StartMap(const InitialPair& pair);
  void StartFromPanorama(const KeyFrameCandidate& candidate);
  void InsertKeyFrame(const KeyFrameCandidate& candidate);
  void InsertSixDof(const KeyFrameCandidate& candidate, Map::KeyFrameRecord* record);
  void InsertPanorama(const KeyFrameCandidate& candidate);
  // Tries one waiting panorama keyframe, of those that were never tried or of the others; false when none is
  // worth trying.
  bool LocalizeNew();
  bool LocalizeAgain();
  void TryToLocalize(Unlocalized* waiting, std::size_t finite);
  std::size_t CountFinite() const;
  // guess: see LocalizePanoramaKeyFrame.
  bool Localize(KeyFrameId keyframe, const Rigid3* guess);
  // Appearance for the infinite points of one pair of keyframes; false when no pair waits.
  bool ConvertOne();
  void PlanConversions(KeyFrameId keyframe);
  bool IsFinite() const;  // the map knows depth
  void ApplyReports();
  std::vector<KeyFrameId> Partners(KeyFrameId keyframe);
  void MatchNewPoints();
  void LocalAdjustment();
  void GlobalAdjustment();
  // The most urgent step towards closing a loop; false when there is none.
  bool WorkOnLoops();
  void KeepImages(Task* task) const;
  // A candidate as it would have been offered had it been tracked in the map as it is now.
  KeyFrameCandidate UpToDate(KeyFrameCandidate candidate) const;
  void CullRedundantKeyFrame();  // removes one redundant keyframe
  void Publish();
  void Tell(MapperEvent::Kind kind, Timestamp time, std::string detail);

  const MapperOptions options_;
  // Touched by the stepping thread alone.
  Map map_;
  PointSearcher searcher_;
  MapDescriptors descriptors_;
  KeyFrameId newest_ = kNoId;
  std::vector<MapPointId> to_match_;
  std::vector<Unlocalized> to_localize_;
  std::deque<std::pair<KeyFrameId, KeyFrameId>> to_convert_;  // (reference, partner)
  LoopCloser loops_;
  bool loop_to_adjust_ = false;  // by the next global adjustment
  std::size_t keyframes_since_global_ = 0;
  bool global_interrupted_ = false;  // or due for another reason
  bool culling_due_ = false;         // the map has settled since keyframes were last looked through

  std::atomic<bool> interrupt_{false};
  std::atomic<bool> locally_adjusted_{true};
  mutable std::mutex mutex_;  // guards what follows; held for copies of pointers and small lists only
  std::deque<Task> queue_;
  std::optional<std::chrono::steady_clock::time_point> offered_during_step_;
  bool stepping_ = false;
  std::vector<PointReport> reports_;
  std::shared_ptr<const MapSnapshot> snapshot_;
  std::vector<MapperEvent> events_;
  MapperTimes times_;
};

}  // namespace docent::engine
