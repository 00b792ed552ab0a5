// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/map_joining.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/base/processor_time.h"
#include "engine/map/map_readout.h"
#include "engine/mapping/bundle/map_adjustment.h"

namespace docent::engine {
namespace {

// Neighbours of each candidate's keyframe that are searched for duplicate points, as for a loop.
constexpr std::size_t kJoinNeighbours = 16;

// Both maps in one, with one readout time for all images of a lens.
struct TwoInOne {
  TwoInOne(const MapSnapshot& a, const MapSnapshot& b)
      : map(SideBySide(a, b, &ids)), readout_changed(UniteReadouts(ids.first_keyframe, &map)) {}

  JoinedIds ids;
  Map map;
  bool readout_changed;
};

// Transforms the part of the map that came from B by the similarity.
void MoveB(const Sim3& a_from_b, KeyFrameId first_of_b, Map* map) {
  std::map<KeyFrameId, Sim3> after_from_before;
  for (const auto& [id, record] : map->keyframes()) {
    if (id >= first_of_b && record.keyframe.kind == KeyFrameKind::kSixDof) after_from_before[id] = a_from_b;
  }
  map->Correct(after_from_before);
}

// Updates candidates that were made before B was moved: keyframe and place now have the same scale.
void Rescale(const Sim3& a_from_b, KeyFrameId first_of_b, std::vector<LoopCandidate>* candidates) {
  for (LoopCandidate& candidate : *candidates) {
    // A scale is lengths in the keyframe's frame over lengths in the frame of the place.
    const bool of_b = candidate.keyframe >= first_of_b;
    const double unit = of_b ? a_from_b.scale : 1 / a_from_b.scale;
    candidate.keyframe_from_place.scale *= unit;
    // The translation is in the keyframe's frame, and only the keyframes of B have changed their scale.
    if (of_b) candidate.keyframe_from_place.translation *= a_from_b.scale;
  }
}

// Distributes the drift of both maps over their pose graph. Returns false if that would bend them too far.
bool SpreadDrift(const LoopCorrectionOptions& options, const std::vector<LoopCandidate>& candidates,
                 Map* map) {
  LoopGraph graph = MakeLoopGraph(options, candidates, map);
  if (!SolvePoseGraph(options.graph, &graph.graph).solved || !IsConsistent(options, graph)) return false;
  ApplyLoopGraph(graph, map);
  return true;
}

// A point that both maps contain keeps the id of A, because content of A is anchored to these points.
void KeepIdsOfA(MapPointId first_of_b, std::vector<LoopCandidate>* candidates) {
  for (LoopCandidate& candidate : *candidates) {
    for (DuplicatePoints& duplicates : candidate.duplicates) {
      if (duplicates.known >= first_of_b) std::swap(duplicates.known, duplicates.recent);
    }
  }
}

MapAdjustmentOptions FirstAdjustment(const MapJoiningOptions& options) {
  MapAdjustmentOptions adjustment;
  adjustment.global_iterations = options.global_iterations;
  adjustment.global_loss = RobustLoss::kHuber;
  return adjustment;
}

// The remaining error at the seam takes several adjustments: rounds with Huber's loss while the cost
// decreases considerably, then one with the standard loss.
void Adjust(const MapJoiningOptions& options, const std::atomic<bool>* interrupt, Map* map) {
  MapAdjustmentOptions adjustment = FirstAdjustment(options);
  for (int round = 0; round < options.max_rounds; ++round) {
    const BundleSummary summary = AdjustGlobally(adjustment, interrupt, map);
    if (summary.final_cost >= options.max_cost_ratio * summary.initial_cost) break;
  }
  adjustment.global_loss = RobustLoss::kTukey;
  AdjustGlobally(adjustment, interrupt, map);
}

// Fuses pairs of points that the two maps have of one physical point; returns the number of pairs. Duplicates
// within one map stay: each keyframe is searched for points of the other map only.
int FuseDuplicatePoints(const JoinedIds& ids, const std::vector<LoopCandidate>& candidates,
                        const std::atomic<bool>* interrupt, Map* map) {
  std::set<KeyFrameId> about;
  int merged = 0;
  for (const LoopCandidate& candidate : candidates) {
    merged += FuseCandidateDuplicates(candidate, map);
    about.insert({candidate.keyframe, candidate.place});
  }
  for (const LoopCandidate& candidate : candidates) {
    auto neighbours = map->Covisible(candidate.keyframe);
    if (neighbours.size() > kJoinNeighbours) neighbours.resize(kJoinNeighbours);
    for (const auto& [id, shared] : neighbours) about.insert(id);
  }
  for (const KeyFrameId id : about) map->UpdateDepth(map->FindKeyFrame(id));
  PointSearcher searcher;
  for (const KeyFrameId id : about) {
    if (interrupt && *interrupt) return merged;
    auto neighbours = map->Covisible(id);
    if (neighbours.size() > kJoinNeighbours) neighbours.resize(kJoinNeighbours);
    std::set<MapPointId> points;
    for (const auto& [other, shared] : neighbours) {
      for (const Observation& observation : map->FindKeyFrame(other)->observations) {
        if ((observation.point < ids.first_point) != (id < ids.first_keyframe))
          points.insert(observation.point);
      }
    }
    merged += MatchAndFusePoints(id, {points.begin(), points.end()}, map, &searcher);
  }
  return merged;
}

// Whether together two maps have more ids than one map can hold.
bool HaveTooManyIds(const MapSnapshot& a, const MapSnapshot& b) {
  const auto full = [](std::uint32_t next_a, std::uint32_t next_b) { return next_b >= kNoId - next_a; };
  return full(a.next_keyframe, b.next_keyframe) || full(a.next_point, b.next_point) ||
         full(a.next_panorama, b.next_panorama);
}

// Whether the maps may be joined; otherwise the attempt says why not.
bool MayBeJoined(const MapSnapshot& a, const MapSnapshot& b, MapJoinAttempt* attempt) {
  if (HaveTooManyIds(a, b)) {
    attempt->refusal = JoinRefusal::kTooManyIds;
  } else if (attempt->overlap.outcome != MapOverlap::Outcome::kOverlap) {
    attempt->refusal = JoinRefusal::kNoOverlap;
  }
  return attempt->refusal == JoinRefusal::kNone;
}

// Joins both maps according to attempt->overlap, but for the adjustment. Null if that would bend them too
// far.
std::shared_ptr<JoinedMap> Unite(const MapJoiningOptions& options, const std::atomic<bool>* interrupt,
                                 MapJoinAttempt* attempt, TwoInOne* both) {
  const JoinedIds& ids = both->ids;
  auto joined = std::make_shared<JoinedMap>();
  joined->ids = ids;
  joined->a_from_b = attempt->overlap.a_from_b;
  std::vector<LoopCandidate> candidates = attempt->overlap.candidates;
  MoveB(joined->a_from_b, ids.first_keyframe, &both->map);
  Rescale(joined->a_from_b, ids.first_keyframe, &candidates);
  joined->aligned = both->map.Snapshot();
  if (!SpreadDrift(options.correction, candidates, &both->map)) {
    attempt->refusal = JoinRefusal::kTooMuchDrift;
    return nullptr;
  }
  KeepIdsOfA(ids.first_point, &candidates);
  joined->points_merged = FuseDuplicatePoints(ids, candidates, interrupt, &both->map);
  return joined;
}

std::size_t KeyFramesOf(const MapSnapshot& a, const MapSnapshot& b) {
  return a.keyframes.size() + b.keyframes.size();
}

void Complete(std::shared_ptr<JoinedMap> joined, const std::atomic<bool>* interrupt, MapJoinAttempt* attempt,
              Map* map) {
  if (interrupt && *interrupt) {
    attempt->refusal = JoinRefusal::kInterrupted;
    return;
  }
  joined->map = map->Snapshot();
  attempt->joined = std::move(joined);
}

JoinedIds IdsAfter(const MapSnapshot& a) {
  return {a.next_keyframe, a.next_point, a.next_panorama};
}

// Gives the keyframes and points of B in a candidate the ids that they have beside a later state of A.
void Renumber(const JoinedIds& then, const JoinedIds& now, LoopCandidate* candidate) {
  const auto keyframe = [&](KeyFrameId* id) {
    if (*id >= then.first_keyframe) *id += now.first_keyframe - then.first_keyframe;
  };
  const auto point = [&](MapPointId* id) {
    if (*id >= then.first_point) *id += now.first_point - then.first_point;
  };
  keyframe(&candidate->keyframe);
  keyframe(&candidate->place);
  for (Observation& seen : candidate->seen) {
    keyframe(&seen.keyframe);
    point(&seen.point);
  }
  for (DuplicatePoints& duplicates : candidate->duplicates) {
    point(&duplicates.known);
    point(&duplicates.recent);
  }
}

// Whether both keyframes of a candidate are in B or still in A.
bool IsComplete(const LoopCandidate& candidate, const MapComparison& comparison, const MapSnapshot& a) {
  const auto exists = [&](KeyFrameId id) {
    return id >= comparison.a->next_keyframe || a.FindKeyFrame(id) != nullptr;
  };
  return exists(candidate.keyframe) && exists(candidate.place);
}

}  // namespace

std::optional<std::string> MapJoiningOptions::Validate() const {
  return OptionCheck()
      .Contained(overlap.Validate())
      .Contained(correction.Validate())
      .AtLeast(global_iterations, 1, "number of iterations after joining")
      .AtLeast(max_rounds, 0, "number of adjustments after joining")
      .Ratio(max_cost_ratio, "cost ratio of two adjustments after joining")
      .fault();
}

MapSnapshot SideBySide(const MapSnapshot& a, const MapSnapshot& b, JoinedIds* ids) {
  *ids = IdsAfter(a);
  MapSnapshot both = a;
  both.revision = std::max(a.revision, b.revision);
  both.next_keyframe += b.next_keyframe;
  both.next_point += b.next_point;
  both.next_panorama += b.next_panorama;
  const auto panorama = [&](PanoramaId id) { return id == kNoId ? kNoId : id + ids->first_panorama; };
  for (KeyFrame keyframe : b.keyframes) {
    keyframe.id += ids->first_keyframe;
    keyframe.panorama = panorama(keyframe.panorama);
    keyframe.fixed = false;
    both.keyframes.push_back(std::move(keyframe));
  }
  for (MapPoint point : b.points) {
    point.id += ids->first_point;
    point.panorama = panorama(point.panorama);
    point.source_keyframe += ids->first_keyframe;
    both.points.push_back(point);
  }
  for (Observation observation : b.observations) {
    observation.keyframe += ids->first_keyframe;
    observation.point += ids->first_point;
    both.observations.push_back(observation);
  }
  for (const PanoramaMap& of_b : b.panoramas)
    both.panoramas.push_back({panorama(of_b.id), of_b.reference + ids->first_keyframe});
  return both;
}

MapOverlap CompareMaps(const MapOverlapOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                       const std::atomic<bool>* interrupt) {
  Checked(options);
  if (HaveTooManyIds(a, b)) return {};
  TwoInOne both(a, b);
  return FindOverlap(options, both.ids.first_keyframe, interrupt, &both.map);
}

MapComparison CompareForJoining(const MapOverlapOptions& options, std::shared_ptr<const MapSnapshot> a,
                                std::shared_ptr<const MapSnapshot> b, const std::atomic<bool>* interrupt) {
  const double start = ProcessorSeconds();
  MapComparison comparison;
  comparison.overlap = CompareMaps(options, *a, *b, interrupt);
  comparison.a = std::move(a);
  comparison.b = std::move(b);
  comparison.seconds = ProcessorSeconds() - start;
  return comparison;
}

bool StillApplies(const MapJoiningOptions& options, const MapComparison& comparison, const MapSnapshot& a) {
  if (comparison.overlap.outcome != MapOverlap::Outcome::kOverlap) return true;
  if (!a.corrections.empty() && a.corrections.back()->revision > comparison.a->revision) return false;
  const auto left = std::ranges::count_if(comparison.overlap.candidates, [&](const LoopCandidate& candidate) {
    return IsComplete(candidate, comparison, a);
  });
  return static_cast<std::size_t>(left) >= options.overlap.min_consecutive;
}

MapJoinAttempt JoinCompared(const MapJoiningOptions& options, const MapComparison& comparison,
                            const MapSnapshot& a, const std::atomic<bool>* interrupt) {
  Checked(options);
  MapJoinAttempt attempt;
  attempt.keyframes = KeyFramesOf(*comparison.a, *comparison.b);
  attempt.overlap = comparison.overlap;
  if (!MayBeJoined(a, *comparison.b, &attempt)) return attempt;
  std::erase_if(attempt.overlap.candidates,
                [&](const LoopCandidate& candidate) { return !IsComplete(candidate, comparison, a); });
  TwoInOne both(a, *comparison.b);
  for (LoopCandidate& candidate : attempt.overlap.candidates)
    Renumber(IdsAfter(*comparison.a), both.ids, &candidate);
  auto joined = Unite(options, interrupt, &attempt, &both);
  if (!joined) return attempt;
  if (both.readout_changed) AdjustGlobally(FirstAdjustment(options), interrupt, &both.map);
  Complete(std::move(joined), interrupt, &attempt, &both.map);
  return attempt;
}

MapJoinAttempt JoinMaps(const MapJoiningOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                        const std::atomic<bool>* interrupt) {
  Checked(options);
  MapJoinAttempt attempt;
  attempt.keyframes = KeyFramesOf(a, b);
  if (HaveTooManyIds(a, b)) {
    attempt.refusal = JoinRefusal::kTooManyIds;
    return attempt;
  }
  TwoInOne both(a, b);
  attempt.overlap = FindOverlap(options.overlap, both.ids.first_keyframe, interrupt, &both.map);
  if (!MayBeJoined(a, b, &attempt)) return attempt;
  auto joined = Unite(options, interrupt, &attempt, &both);
  if (!joined) return attempt;
  Adjust(options, interrupt, &both.map);
  Complete(std::move(joined), interrupt, &attempt, &both.map);
  return attempt;
}

}  // namespace docent::engine
