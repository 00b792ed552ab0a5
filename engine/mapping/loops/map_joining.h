// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "engine/mapping/loops/loop_correction.h"
#include "engine/mapping/loops/map_overlap.h"

// Joins two maps that show one place (map_overlap.h verifies that they do). Map A keeps its coordinates, its
// scale and its ids; map B is transformed into them with everything in it, panorama maps and infinite points
// included. All images of a lens get one readout time (UniteReadouts). Points that both maps contain are
// fused, and the joined map is adjusted, by JoinCompared only as far as it must be at once. Pure functions:
// any thread, equal input gives an equal result.
namespace docent::engine {

struct MapJoiningOptions {
  MapOverlapOptions overlap;
  LoopCorrectionOptions correction;
  // Global adjustment afterwards: rounds with Huber's loss as after a loop, until a round's final cost
  // exceeds this ratio of its initial cost.
  int global_iterations = 12, max_rounds = 6;
  double max_cost_ratio = 0.9;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// An id of B in the joined map is its own id plus the one given here. No id is assigned twice.
struct JoinedIds {
  KeyFrameId first_keyframe = 0;
  MapPointId first_point = 0;
  PanoramaId first_panorama = 0;
};

struct JoinedMap {
  std::shared_ptr<const MapSnapshot> map;
  // Both maps with the ids and in the coordinates of the joined map, before the adjustment: A unchanged, B
  // moved by a_from_b. A place in one of them is transferred to `map` through the points around it
  // (local_points.h).
  std::shared_ptr<const MapSnapshot> aligned;
  Sim3 a_from_b;
  JoinedIds ids;
  int points_merged = 0;
};

// Why two maps were not joined.
enum class JoinRefusal : std::uint8_t {
  kNone,          // they were joined
  kTooManyIds,    // together they have more ids than one map can hold
  kNoOverlap,     // see MapOverlap::outcome
  kTooMuchDrift,  // the pose graph of one map does not fit the other
  kInterrupted,
};

struct MapJoinAttempt {
  MapOverlap overlap;                       // its keyframes have the ids of the joined map
  std::shared_ptr<const JoinedMap> joined;  // null if the maps were not joined
  JoinRefusal refusal = JoinRefusal::kNone;
  std::size_t keyframes = 0;  // of both maps when they were compared
};

// Both maps must be valid (Validate) and have full features (MakeFeatures). interrupt may be null.
MapJoinAttempt JoinMaps(const MapJoiningOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                        const std::atomic<bool>* interrupt);

// Two maps and what a comparison of them gave.
struct MapComparison {
  std::shared_ptr<const MapSnapshot> a, b;
  MapOverlap overlap;  // its keyframes and points have the ids that SideBySide gives them
  double seconds = 0;  // processor time
};
// Both maps must be as for JoinMaps; interrupt may be null.
MapComparison CompareForJoining(const MapOverlapOptions& options, std::shared_ptr<const MapSnapshot> a,
                                std::shared_ptr<const MapSnapshot> b, const std::atomic<bool>* interrupt);
// Whether a comparison says where B is in the present state of A, which was extended and adjusted meanwhile:
// A has no later correction (of a loop or of a lens), and of the keyframes that confirm the overlap at least
// MapOverlapOptions::min_consecutive are left.
bool StillApplies(const MapJoiningOptions& options, const MapComparison& comparison, const MapSnapshot& a);
// Joins B into the present state of A, for which the comparison must still apply. Unlike JoinMaps, it leaves
// the adjustment to the caller, as after a loop was closed: until then the seam has errors of a few pixels.
// Only where a readout time changes, which displaces much more, one adjustment is done.
MapJoinAttempt JoinCompared(const MapJoiningOptions& options, const MapComparison& comparison,
                            const MapSnapshot& a, const std::atomic<bool>* interrupt);

// Decides whether two maps show one place, and only that. Both must be as for JoinMaps; interrupt may be
// null.
MapOverlap CompareMaps(const MapOverlapOptions& options, const MapSnapshot& a, const MapSnapshot& b,
                       const std::atomic<bool>* interrupt);

// Both maps in one snapshot, without moving either: the ids of B are raised, and its keyframes are no longer
// fixed, so that those of A alone define the coordinate frame. The revision is the higher of the two.
MapSnapshot SideBySide(const MapSnapshot& a, const MapSnapshot& b, JoinedIds* ids);

}  // namespace docent::engine
