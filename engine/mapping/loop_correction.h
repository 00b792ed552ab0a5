// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/mapping/loop_detector.h"
#include "engine/mapping/pose_graph.h"

// How a map is put right once a loop is known: the error is spread over the whole way, and what was mapped
// twice becomes one. For the mapper's thread.
namespace docent::engine {

struct LoopCorrectionOptions {
  PoseGraphOptions graph;
  int edges = 6;  // of each keyframe, to those that share most with it
  // By how much the sightings may still disagree with the map once the error is spread: of the depth,
  // radians, logarithm of the scale.
  double max_misfit = 0.05;
  // By how much keyframes that share a hundred points may have been wrong to each other, in the same units. A
  // look-alike that is joined to its duplicate asks more of those in between.
  double max_edge_residual = 0.02;
};

// The keyframes and what they know of each other, and after these edges one for each of the sightings.
struct LoopGraph {
  PoseGraph graph;
  std::vector<KeyFrameId> keyframes;  // of each node
  std::size_t sightings = 0;
};
LoopGraph MakeLoopGraph(const LoopCorrectionOptions& options, const std::vector<LoopCandidate>& sightings,
                        Map* map);
// Whether the relaxed graph has room for the sightings: what is left of them, and what they have asked of the
// other edges, is small.
bool IsConsistent(const LoopCorrectionOptions& options, const LoopGraph& relaxed);
// Moves the map as the relaxed graph says; keyframes that came since go with the one they share most with.
void ApplyLoopGraph(const LoopGraph& relaxed, Map* map);
// Makes one of each two points that the sighting has shown to be one; returns how many there were.
int FuseTwins(const LoopCandidate& sighting, Map* map);

// Appearance in a keyframe for points of other keyframes that it should see, further off than MatchMapPoints,
// and makes one of those that are then seen twice at the same place. Returns how many became one.
int FuseSeenTwice(KeyFrameId keyframe, const std::vector<MapPointId>& points, Map* map,
                  PointSearcher* searcher);

}  // namespace docent::engine
