// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "engine/map/map_snapshot.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::engine {

// The keyframe whose part of the map a frame is tracked in: the source of most of the points that it
// believes; the newest keyframe where it believes none, kNoId in an empty map. For whoever must carry the
// frame's pose along when parts of the map are moved (MapCorrection).
KeyFrameId FindReferenceKeyFrame(const MapSnapshot& map, std::span<const PointMatch> matches);

}  // namespace docent::engine
