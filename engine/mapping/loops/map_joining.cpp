// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/map_joining.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/map/map_readout.h"
#include "engine/mapping/bundle/map_adjustment.h"

namespace docent::engine {
namespace {

// Neighbours of each candidate's keyframe that are searched for duplicate points, as for a loop.
constexpr std::size_t kJoinNeighbours = 16;

// Both maps in one, with one readout time for all images of a lens.
Map PutTogether(const MapSnapshot& a, const MapSnapshot& b, JoinedIds* ids) {
  Map map(SideBySide(a, b, ids));
  UniteReadouts(ids->first_keyframe, &map);
  return map;
}

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

// The remaining error at the seam takes several adjustments: rounds with Huber's loss while the cost
// decreases considerably, then one with the standard loss.
void Adjust(const MapJoiningOptions& options, const std::atomic<bool>* interrupt, Map* map) {
  MapAdjustmentOptions adjustment;
  adjustment.global_iterations = options.global_iterations;
  adjustment.global_loss = RobustLoss::kHuber;
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
  *ids = {a.next_keyframe, a.next_point, a.next_panorama};
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
  JoinedIds ids;
  Map map = PutTogether(a, b, &ids);
  return FindOverlap(options, ids.first_keyframe, interrupt, &map);
}

MapJoinAttempt JoinMaps(const MapJoiningOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                        const std::atomic<bool>* interrupt) {
  Checked(options);
  MapJoinAttempt attempt;
  if (HaveTooManyIds(a, b)) {
    attempt.refusal = JoinRefusal::kTooManyIds;
    return attempt;
  }
  auto joined = std::make_shared<JoinedMap>();
  Map map = PutTogether(a, b, &joined->ids);
  const KeyFrameId first_of_b = joined->ids.first_keyframe;
  attempt.overlap = FindOverlap(options.overlap, first_of_b, interrupt, &map);
  if (attempt.overlap.outcome != MapOverlap::Outcome::kOverlap) {
    attempt.refusal = JoinRefusal::kNoOverlap;
    return attempt;
  }

  joined->a_from_b = attempt.overlap.a_from_b;
  std::vector<LoopCandidate> candidates = attempt.overlap.candidates;
  MoveB(joined->a_from_b, first_of_b, &map);
  Rescale(joined->a_from_b, first_of_b, &candidates);
  joined->aligned = map.Snapshot();
  if (!SpreadDrift(options.correction, candidates, &map)) {
    attempt.refusal = JoinRefusal::kTooMuchDrift;
    return attempt;
  }
  KeepIdsOfA(joined->ids.first_point, &candidates);
  joined->points_merged = FuseDuplicatePoints(joined->ids, candidates, interrupt, &map);
  Adjust(options, interrupt, &map);
  if (interrupt && *interrupt) {
    attempt.refusal = JoinRefusal::kInterrupted;
    return attempt;
  }
  joined->map = map.Snapshot();
  attempt.joined = std::move(joined);
  return attempt;
}

}  // namespace docent::engine
