// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "engine/map/map_snapshot.h"
#include "engine/matching/point_match.h"

namespace docent::engine {

// The reference keyframe of a frame: the source keyframe of most of its inliers; the newest keyframe if there
// are no inliers, kNoId in an empty map. The frame's pose follows the correction (MapCorrection) of this
// keyframe when the mapper moves parts of the map.
KeyFrameId FindReferenceKeyFrame(const MapSnapshot& map, std::span<const PointMatch> matches);

}  // namespace docent::engine
