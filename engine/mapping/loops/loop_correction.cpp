// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_correction.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/mapping/points/covisibility.h"

namespace docent::engine {

namespace {

// Makes the pose graph of the localized keyframes of a map.
class LoopGraphBuilder {
 public:
  explicit LoopGraphBuilder(Map* map) : sharing_(*map), count_(sharing_.keyframes().size()) {
    result_.keyframes = sharing_.keyframes();
    std::vector<PoseGraph::Node>& nodes = result_.graph.nodes;
    bool any_fixed = false;
    for (const KeyFrameId id : sharing_.keyframes()) {
      const KeyFrame& keyframe = map->FindKeyFrame(id)->keyframe;
      nodes.push_back({AsSim3(keyframe.camera_from_map), keyframe.fixed, keyframe.mean_depth});
      any_fixed = any_fixed || keyframe.fixed;
    }
    if (!any_fixed && count_ > 0) nodes.front().fixed = true;
  }

  // Joins each keyframe to its neighbours among those that share most points with it.
  void JoinNeighbours(std::size_t edges) {
    const std::size_t most = std::min(count_, edges);
    std::vector<std::size_t> order(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      std::iota(order.begin(), order.end(), 0);
      std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(most), order.end(),
                        [&](std::size_t a, std::size_t b) {
                          return std::pair(-sharing_.Shared(i, a), a) < std::pair(-sharing_.Shared(i, b), b);
                        });
      for (std::size_t k = 0; k < most; ++k) {
        if (sharing_.AreNeighbours(i, order[k])) Join(i, order[k]);
      }
    }
  }

  // Joins components of the graph that are not connected yet by the strongest remaining links, and failing
  // those by the order of the keyframes.
  void JoinComponents() {
    std::vector<std::size_t> part(count_);
    std::iota(part.begin(), part.end(), 0);
    const auto root = [&](std::size_t i) {
      while (part[i] != i) i = part[i] = part[part[i]];
      return i;
    };
    for (const auto& [a, b] : joined_) part[root(a)] = root(b);
    std::vector<std::tuple<int, std::size_t, std::size_t>> links;
    for (std::size_t a = 0; a < count_; ++a) {
      for (std::size_t b = a + 1; b < count_; ++b) {
        if (sharing_.Shared(a, b) > 0) links.emplace_back(-sharing_.Shared(a, b), a, b);
      }
      if (a + 1 < count_) links.emplace_back(0, a, a + 1);
    }
    std::sort(links.begin(), links.end());
    for (const auto& [shared, a, b] : links) {
      if (root(a) == root(b)) continue;
      part[root(a)] = root(b);
      Join(a, b);
    }
  }

  void AddCandidates(const std::vector<LoopCandidate>& candidates) {
    // The pose of a loop candidate is known to about a pixel from hundreds of points, so it outweighs the
    // other edges.
    constexpr double kCandidateWeight = 10;
    result_.candidates = candidates.size();
    for (const LoopCandidate& candidate : candidates) {
      result_.graph.edges.push_back({static_cast<int>(sharing_.IndexOf(candidate.keyframe)),
                                     static_cast<int>(sharing_.IndexOf(candidate.place)),
                                     candidate.keyframe_from_place, kCandidateWeight});
    }
  }

  LoopGraph Take() { return std::move(result_); }

 private:
  void Join(std::size_t a, std::size_t b) {
    if (a > b) std::swap(a, b);
    if (a == b || !joined_.emplace(a, b).second) return;
    const std::vector<PoseGraph::Node>& nodes = result_.graph.nodes;
    const Sim3 a_from_b = nodes[a].node_from_map * nodes[b].node_from_map.inverse();
    const double weight = std::clamp(sharing_.Shared(a, b) / 100.0, 0.05, 1.0);
    result_.graph.edges.push_back({static_cast<int>(a), static_cast<int>(b), a_from_b, weight});
  }

  const Covisibility sharing_;
  const std::size_t count_;
  LoopGraph result_;
  std::set<std::pair<std::size_t, std::size_t>> joined_;
};

}  // namespace

std::optional<std::string> LoopCorrectionOptions::Validate() const {
  return OptionCheck()
      .Contained(graph.Validate())
      .AtLeast(edges, 1, "number of edges of a keyframe")
      .Positive(max_loop_residual, "edge residual of a loop candidate")
      .Positive(max_edge_residual, "edge residual of a pose graph")
      .Ratio(max_exceeding_edges, "ratio of the edges with a larger residual")
      .fault();
}

LoopGraph MakeLoopGraph(const LoopCorrectionOptions& options, const std::vector<LoopCandidate>& candidates,
                        Map* map) {
  LoopGraphBuilder builder(map);
  builder.JoinNeighbours(static_cast<std::size_t>(options.edges));
  builder.JoinComponents();
  builder.AddCandidates(candidates);
  return builder.Take();
}

bool IsConsistent(const LoopCorrectionOptions& options, const LoopGraph& optimized) {
  const std::size_t first_candidate = optimized.graph.edges.size() - optimized.candidates;
  std::size_t exceeding = 0;
  for (std::size_t i = 0; i < optimized.graph.edges.size(); ++i) {
    const PoseGraph::Edge& edge = optimized.graph.edges[i];
    const double left = LargestError(optimized.graph, edge) * (i < first_candidate ? edge.weight : 1);
    if (left > options.max_loop_residual) return false;
    if (i < first_candidate && left > options.max_edge_residual) ++exceeding;
  }
  return static_cast<double>(exceeding) <= options.max_exceeding_edges * static_cast<double>(first_candidate);
}

void ApplyLoopGraph(const LoopGraph& optimized, Map* map) {
  std::map<KeyFrameId, Sim3> after_from_before;
  for (std::size_t i = 0; i < optimized.keyframes.size(); ++i) {
    const Map::KeyFrameRecord* record = map->FindKeyFrame(optimized.keyframes[i]);
    if (!record || optimized.graph.nodes[i].fixed) continue;
    after_from_before[optimized.keyframes[i]] =
        optimized.graph.nodes[i].node_from_map.inverse() * AsSim3(record->keyframe.camera_from_map);
  }
  for (const auto& [id, record] : map->keyframes()) {
    if (record.keyframe.kind != KeyFrameKind::kSixDof ||
        std::binary_search(optimized.keyframes.begin(), optimized.keyframes.end(), id))
      continue;
    for (const auto& [other, shared] : map->Covisible(id)) {
      const auto moved = after_from_before.find(other);
      if (moved == after_from_before.end()) continue;
      after_from_before[id] = moved->second;
      break;
    }
  }
  map->Correct(after_from_before);
}

int FuseCandidateDuplicates(const LoopCandidate& candidate, Map* map) {
  for (const Observation& observation : candidate.seen) map->AddObservation(observation);
  int fused = 0;
  for (const DuplicatePoints& duplicates : candidate.duplicates) {
    if (!map->FindPoint(duplicates.known) || !map->FindPoint(duplicates.recent)) continue;
    map->FusePoints(duplicates.known, duplicates.recent);
    ++fused;
  }
  return fused;
}

int MatchAndFusePoints(KeyFrameId id, const std::vector<MapPointId>& points, Map* map,
                       PointSearcher* searcher) {
  constexpr float kRadiusPx = 10;  // level 0: covers the error that remains after the pose graph optimization
  constexpr double kMaxErrorPx = 5;    // of the level
  constexpr double kSamePx = 1.5;      // of the coarser level
  constexpr double kSameDepth = 0.08;  // relative
  const Map::KeyFrameRecord* const record = map->FindKeyFrame(id);
  if (!record || record->keyframe.kind != KeyFrameKind::kSixDof) return 0;
  const KeyFrame& keyframe = record->keyframe;
  std::vector<Observation> found;
  for (const MapPointId point_id : points) {
    const Map::PointRecord* const point = map->FindPoint(point_id);
    if (!point || point->point.infinite() ||
        std::binary_search(point->observers.begin(), point->observers.end(), id))
      continue;
    const Map::KeyFrameRecord* const source = map->FindKeyFrame(point->point.source_keyframe);
    if (!source) continue;
    const auto predicted =
        searcher->Predict(point->point, source->keyframe, *keyframe.camera, keyframe.camera_from_map);
    if (!predicted) continue;
    const auto seen =
        searcher->Find(point->point, source->keyframe, *predicted, *keyframe.features, kRadiusPx, false);
    if (!seen ||
        (seen->pixel.cast<double>() - predicted->pixel).norm() > kMaxErrorPx * (1 << predicted->level))
      continue;
    found.push_back({id, point_id, seen->pixel, static_cast<std::uint8_t>(predicted->level)});
  }
  const std::vector<Observation> own = record->observations;
  int fused = 0;
  for (const Observation& seen : found) {
    const Map::PointRecord* point = map->FindPoint(seen.point);
    if (!point) continue;
    const double depth = (keyframe.camera_from_map * point->point.position()).z();
    MapPointId duplicate = kNoId;
    for (const Observation& observation : own) {
      const double limit = kSamePx * (1 << std::max(seen.level, observation.level));
      if ((observation.pixel - seen.pixel).norm() > limit) continue;
      const Map::PointRecord* other = map->FindPoint(observation.point);
      if (!other || other->point.infinite()) continue;
      const double other_depth = (keyframe.camera_from_map * other->point.position()).z();
      if (std::abs(other_depth - depth) <= kSameDepth * depth) {
        duplicate = observation.point;
        break;
      }
    }
    if (duplicate == kNoId) {
      map->AddObservation(seen);
      continue;
    }
    map->FusePoints(std::min(duplicate, seen.point), std::max(duplicate, seen.point));
    ++fused;
  }
  return fused;
}

}  // namespace docent::engine
