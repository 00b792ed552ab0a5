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

// Both maps side by side in one, unmoved: the ids of B are raised, and its fixed keyframes let go, so that
// A's alone hold the frame. The revision is the higher of the two.
MapSnapshot SideBySide(const MapSnapshot& a, const MapSnapshot& b, JoinedIds* ids);

}  // namespace docent::engine
