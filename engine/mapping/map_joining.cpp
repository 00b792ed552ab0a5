// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/map_joining.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "engine/mapping/map_adjustment.h"

namespace docent::engine {
namespace {

constexpr std::size_t kNeighbours = 16;  // of each sighting's keyframe, that are gone through: as for a loop

// Moves the part of B by the similarity.
void MoveB(const Sim3& a_from_b, KeyFrameId first_of_b, Map* map) {
  std::map<KeyFrameId, Sim3> after_from_before;
  for (const auto& [id, record] : map->keyframes()) {
    if (id >= first_of_b && record.keyframe.kind == KeyFrameKind::kSixDof) after_from_before[id] = a_from_b;
  }
  map->Correct(after_from_before);
}

// The sightings were made before B was moved: their places and keyframes have one unit now.
void Rescale(const Sim3& a_from_b, KeyFrameId first_of_b, std::vector<LoopCandidate>* sightings) {
  for (LoopCandidate& sighting : *sightings) {
    // Lengths in the keyframe's frame over lengths in the place's frame.
    const bool of_b = sighting.keyframe >= first_of_b;
    const double unit = of_b ? a_from_b.scale : 1 / a_from_b.scale;
    sighting.keyframe_from_place.scale *= unit;
    // The translation is in the keyframe's frame: only B's keyframes have changed their unit.
    if (of_b) sighting.keyframe_from_place.translation *= a_from_b.scale;
  }
}

// Spreads what the maps have drifted over both. False where they would have to be bent too far.
bool SpreadDrift(const LoopCorrectionOptions& options, const std::vector<LoopCandidate>& sightings,
                 Map* map) {
  LoopGraph graph = MakeLoopGraph(options, sightings, map);
  if (!RelaxPoseGraph(options.graph, &graph.graph).solved || !IsConsistent(options, graph)) return false;
  ApplyLoopGraph(graph, map);
  return true;
}

// What both maps have keeps the id of A: content of A stands among these points.
void KeepIdsOfA(MapPointId first_of_b, std::vector<LoopCandidate>* sightings) {
  for (LoopCandidate& sighting : *sightings) {
    for (DuplicatePoints& duplicates : sighting.duplicates) {
      if (duplicates.known >= first_of_b) std::swap(duplicates.known, duplicates.recent);
    }
  }
}

// The error of a seam sinks into the map slowly: with Huber's loss on as long as it becomes clearly less, and
// then once more with the usual one. False where the adjustment fails.
bool Adjust(const MapJoiningOptions& options, const std::atomic<bool>* interrupt, Map* map) {
  MapAdjustmentOptions adjustment;
  adjustment.global_iterations = options.global_iterations;
  adjustment.global_loss = RobustLoss::kHuber;
  for (int round = 0; round < options.max_rounds; ++round) {
    const BundleSummary summary = AdjustGlobally(adjustment, interrupt, map);
    if (summary.outcome == BundleSummary::Outcome::kFailed) return false;
    if (summary.final_cost >= options.clearly_less * summary.initial_cost) break;
  }
  adjustment.global_loss = RobustLoss::kTukey;
  return AdjustGlobally(adjustment, interrupt, map).outcome != BundleSummary::Outcome::kFailed;
}

// Makes one of each two points that the maps have of one physical point; returns how many there were. What
// one map has twice by itself stays: each keyframe is searched for points of the other map alone.
int FuseDuplicatePoints(const JoinedIds& ids, const std::vector<LoopCandidate>& sightings,
                        const std::atomic<bool>* interrupt, Map* map) {
  std::set<KeyFrameId> about;
  int merged = 0;
  for (const LoopCandidate& sighting : sightings) {
    merged += FuseTwins(sighting, map);
    about.insert({sighting.keyframe, sighting.place});
  }
  for (const LoopCandidate& sighting : sightings) {
    auto neighbours = map->Covisible(sighting.keyframe);
    if (neighbours.size() > kNeighbours) neighbours.resize(kNeighbours);
    for (const auto& [id, shared] : neighbours) about.insert(id);
  }
  for (const KeyFrameId id : about) map->UpdateDepth(map->FindKeyFrame(id));
  PointSearcher searcher;
  for (const KeyFrameId id : about) {
    if (interrupt && *interrupt) return merged;
    auto neighbours = map->Covisible(id);
    if (neighbours.size() > kNeighbours) neighbours.resize(kNeighbours);
    std::set<MapPointId> points;
    for (const auto& [other, shared] : neighbours) {
      for (const Observation& observation : map->FindKeyFrame(other)->observations) {
        if ((observation.point < ids.first_point) != (id < ids.first_keyframe))
          points.insert(observation.point);
      }
    }
    merged += FuseSeenTwice(id, {points.begin(), points.end()}, map, &searcher);
  }
  return merged;
}

}  // namespace

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

MapJoinAttempt JoinMaps(const MapJoiningOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                        const std::atomic<bool>* interrupt) {
  MapJoinAttempt attempt;
  const auto full = [](std::uint32_t next_a, std::uint32_t next_b) { return next_b >= kNoId - next_a; };
  if (full(a.next_keyframe, b.next_keyframe) || full(a.next_point, b.next_point) ||
      full(a.next_panorama, b.next_panorama)) {
    attempt.refusal = "together they have given out more ids than a map has";
    return attempt;
  }
  auto joined = std::make_shared<JoinedMap>();
  Map map(SideBySide(a, b, &joined->ids));
  const KeyFrameId first_of_b = joined->ids.first_keyframe;
  attempt.overlap = FindOverlap(options.overlap, first_of_b, interrupt, &map);
  attempt.refusal = ReasonNotToJoin(attempt.overlap);
  if (!attempt.refusal.empty()) return attempt;

  joined->a_from_b = attempt.overlap.a_from_b;
  std::vector<LoopCandidate> sightings = attempt.overlap.sightings;
  MoveB(joined->a_from_b, first_of_b, &map);
  Rescale(joined->a_from_b, first_of_b, &sightings);
  joined->aligned = map.Snapshot();
  if (!SpreadDrift(options.correction, sightings, &map)) {
    attempt.refusal = "one of them would have to be bent too far to fit the other";
    return attempt;
  }
  KeepIdsOfA(joined->ids.first_point, &sightings);
  joined->points_merged = FuseDuplicatePoints(joined->ids, sightings, interrupt, &map);
  if (!Adjust(options, interrupt, &map)) {
    attempt.refusal = "the joined map cannot be adjusted";
    return attempt;
  }
  if (interrupt && *interrupt) {
    attempt.refusal = "the joining was interrupted";
    return attempt;
  }
  joined->map = map.Snapshot();
  attempt.joined = std::move(joined);
  return attempt;
}

}  // namespace docent::engine
