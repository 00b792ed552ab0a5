// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>

#include "engine/mapping/loop_correction.h"
#include "engine/mapping/map_overlap.h"

// Two maps that show one place become one map (see map_overlap.h for the proof). A keeps its coordinates, its
// unit of length and its ids; B is scaled and moved into them with everything that it holds, panorama maps
// and infinite points among it. What both have mapped becomes one, and the whole is adjusted. Pure functions:
// any thread, same input, same result.
namespace docent::engine {

struct MapJoiningOptions {
  MapOverlapOptions overlap;
  LoopCorrectionOptions correction;
  // Of the adjustment that follows: as after a loop, until a round makes the cost no longer clearly less.
  int global_iterations = 12, max_rounds = 6;
  double clearly_less = 0.9;
};

// Ids of B in the joined map are its own plus these. None is given out twice.
struct JoinedIds {
  KeyFrameId first_keyframe = 0;
  MapPointId first_point = 0;
  PanoramaId first_panorama = 0;
};

struct JoinedMap {
  std::shared_ptr<const MapSnapshot> map;
  // Both maps with the ids and in the coordinates of the joined one before anything was adjusted: A as it
  // was, B as a_from_b moves it. Whoever holds a place in one of them finds from this to `map` by the points
  // about it (local_points.h).
  std::shared_ptr<const MapSnapshot> aligned;
  Sim3 a_from_b;
  JoinedIds ids;
  int points_merged = 0;
  // From the coordinates of B to those of the joined map, about a keyframe of B (its id there). Takes a
  // camera along with its surroundings (CarriedAlong).
  Sim3 JoinedFromB(KeyFrameId keyframe_of_b, const MapSnapshot& b) const;
};

struct MapJoinAttempt {
  MapOverlap overlap;                       // its keyframes have the ids of the joined map
  std::shared_ptr<const JoinedMap> joined;  // null where the maps stay two
  // One sentence without a full stop; empty when they were joined.
  std::string refusal;
};

// Both must be valid (Validate), with full features (MakeFeatures). interrupt may be null.
MapJoinAttempt JoinMaps(const MapJoiningOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                        const std::atomic<bool>* interrupt);

// The joined map with what B has come to while the maps were being joined: new keyframes go along with the
// keyframe of b_then that they share most points with, new points with their source keyframe. What new
// keyframes saw of points that were merged away is left out, as are new panorama maps about keyframes of
// b_then. b_then is the B that was joined, b_now a later snapshot of the same map. The result is valid.
std::shared_ptr<const MapSnapshot> WithGrowthOfB(const JoinedMap& joined, const MapSnapshot& b_then,
                                                 const MapSnapshot& b_now);

// Both maps side by side in one, unmoved: the ids of B are raised, and its fixed keyframes let go, so that
// A's alone hold the frame. The revision is the higher of the two.
MapSnapshot SideBySide(const MapSnapshot& a, const MapSnapshot& b, JoinedIds* ids);

}  // namespace docent::engine
