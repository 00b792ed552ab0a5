// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/mapping/loops/loop_detector.h"
#include "engine/mapping/loops/pose_graph.h"

// Corrects the map once a loop is known: distributes the error over the pose graph, and fuses points that
// were mapped twice. For the mapper's thread.
namespace docent::engine {

struct LoopCorrectionOptions {
  PoseGraphOptions graph;
  int edges = 6;  // of each keyframe, to those that share most points with it
  // Largest residual of a loop candidate's edge after the optimization: ratio of the median depth, radians,
  // or logarithm of the scale.
  double max_loop_residual = 0.05;
  // Largest weighted residual of the other edges after the optimization, in the same units; the weight is 1
  // for keyframes that share a hundred points. A false loop between two similar places would bend the edges
  // between them by more.
  double max_edge_residual = 0.02;
  // Ratio of these edges that may have a larger residual, up to `max_loop_residual`. Where a single edge
  // joins two parts of the map, it takes the error alone that several parallel edges share elsewhere. In an
  // office one of 388 to 502 edges exceeded 0.02, by at most 0.023, in 9 of 17 true loops; nine tenths of the
  // edges stayed below 0.01. A false loop gains little, because each such edge takes 0.03 more of its error.
  double max_exceeding_edges = 0.01;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The pose graph of the keyframes: covisibility edges first, then one edge for each loop candidate.
struct LoopGraph {
  PoseGraph graph;
  std::vector<KeyFrameId> keyframes;  // of each node
  std::size_t candidates = 0;
};
LoopGraph MakeLoopGraph(const LoopCorrectionOptions& options, const std::vector<LoopCandidate>& candidates,
                        Map* map);
// True if the optimized graph is consistent with the loop candidates: the residuals of their edges, and those
// that they cause in the other edges, are small.
bool IsConsistent(const LoopCorrectionOptions& options, const LoopGraph& optimized);
// Moves the map to the poses of the optimized graph. A keyframe that was added since moves with the keyframe
// that shares most points with it.
void ApplyLoopGraph(const LoopGraph& optimized, Map* map);
// Fuses the pairs of duplicate points of a loop candidate; returns the number of pairs.
int FuseCandidateDuplicates(const LoopCandidate& candidate, Map* map);

// Searches a keyframe for points of other keyframes that it should see, with a wider radius than
// MatchMapPoints. Adds the matches as observations, and fuses a match with the point that the keyframe
// already observes at the same pixel and depth. Returns the number of fused pairs.
int MatchAndFusePoints(KeyFrameId keyframe, const std::vector<MapPointId>& points, Map* map,
                       PointSearcher* searcher);

}  // namespace docent::engine
