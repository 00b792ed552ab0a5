// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"

// Predicts how well a lost camera is relocalized in a map, by place and direction, using only the map. Each
// keyframe is removed in turn with the points that depend on it, and its image is passed to a tracker that is
// lost in the rest of the map, as many times as images must agree before a pose is accepted. Because
// keyframes are spaced apart, the removed keyframe is about as far from the others as a visitor on the
// author's path can be, so the recall is a lower bound for such visitors. All functions are pure and
// thread-safe.
namespace docent::maps {

struct RelocalizationOptions {
  // A pose that differs more than this from the keyframe's own pose counts as wrong.
  double max_rotation_deg = 5;
  double max_distance = 0.1;  // Ratio of the keyframe's median depth.
  std::uint64_t seed = 1;
};

struct RelocalizationTrial {
  enum class Result { kFound, kNotFound, kWrongPose };
  engine::KeyFrameId keyframe = engine::kNoId;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();       // Camera centre in the map.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // Viewing direction in the map, unit length.
  Result result = Result::kNotFound;
};

// Runs one trial for each localized keyframe, in the order of the map. Only this map is searched, so the
// trials do not measure confusion with other maps. `progress` gets the number of finished trials and returns
// false to stop; it may be empty. The snapshot must have full features.
std::vector<RelocalizationTrial> LeaveEachKeyFrameOut(const engine::MapSnapshot& map,
                                                      const RelocalizationOptions& options = {},
                                                      const std::function<bool(std::size_t)>& progress = {});

// The trials in one square of the floor and one octant of viewing directions.
struct RelocalizationCell {
  // In steps of the side, to the right and ahead of the first keyframe.
  Eigen::Vector2i square = Eigen::Vector2i::Zero();
  int direction = 0;  // Octants clockwise from the first keyframe's view, 0 to 7.
  int trials = 0, found = 0;
  // In map coordinates: the centre of the square at the mean height of the cameras, and the central direction
  // of the octant (unit length).
  Eigen::Vector3d place = Eigen::Vector3d::Zero(), view = Eigen::Vector3d::UnitZ();
};
struct RelocalizationGrid {
  double side = 0;  // Side of a square in map units: half the median of the keyframes' median depths.
  std::vector<RelocalizationCell> cells;  // Those with trials, ordered by square and direction.
};
// The floor is horizontal by engine::UprightAxes.
RelocalizationGrid MakeRelocalizationGrid(const engine::MapSnapshot& map,
                                          const std::vector<RelocalizationTrial>& trials);

}  // namespace docent::maps
