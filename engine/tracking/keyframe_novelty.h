// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "engine/map/map_snapshot.h"
#include "engine/tracking/map_tracker.h"

namespace docent::engine {

struct KeyFrameNoveltyOptions {
  // Distance to the nearest keyframe, as a ratio of the frame's median depth, from which a frame with the
  // same viewing direction is a new view (ptamm §2.2).
  double min_distance = 0.10;
  double min_rotation_deg = 14.0;  // rotation that counts as much as min_distance
  // With fewer finite inliers than this ratio of the nearest keyframe's observations, the frame is about to
  // leave the map.
  double min_found_ratio = 0.60;
  // Upper bound of those observations: a frame searches no more finite points than this.
  double max_expected_points = 600;
  // Smallest distance of a keyframe that is added because few points were found, as a ratio of the median
  // depth: without parallax it could not add points.
  double min_distance_when_few = 0.04;
  double min_rotation_when_few_deg = 5.0;  // the same for the rotation

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Whether this frame should become a keyframe: its view differs enough from all keyframes, or it is about to
// leave the mapped area (ptamm §2.2). The caller checks the tracking quality.
bool NeedsKeyFrame(const KeyFrameNoveltyOptions& options, const MapSnapshot& map,
                   const Rigid3& camera_from_map, const MapTrackResult& tracked);

}  // namespace docent::engine
