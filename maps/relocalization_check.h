// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"

// How well a visitor who is lost will be found in a map, by place and direction, foretold from the map alone:
// each keyframe is left out in turn, with all that it alone holds up, and its image is given to a tracker
// that is lost in what remains, as often as images have to agree before a pose counts, as a visitor's camera
// would deliver them. Keyframes are spaced, so that the one that is left out is about as far from the others
// as a visitor on the author's way can be: the share that is found is a lower bound for such visits. Pure
// functions; any thread.
namespace docent::maps {

struct RelocalizationOptions {
  // A pose further from the keyframe's own is wrong.
  double max_rotation_deg = 5;
  double max_distance = 0.1;  // of the keyframe's mean depth
  std::uint64_t seed = 1;
};

struct RelocalizationTrial {
  enum class Result { kFound, kNotFound, kWrongPose };
  engine::KeyFrameId keyframe = engine::kNoId;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();       // of the camera, in the map
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // of its view, in the map, unit length
  Result result = Result::kNotFound;
};

// One trial a localized keyframe, in the order of the map, on at most that map: how this place is told from
// those of other maps is not asked. `progress` is told the number of trials done and stops them by answering
// false; may be empty. The snapshot has full features.
std::vector<RelocalizationTrial> LeaveEachKeyFrameOut(const engine::MapSnapshot& map,
                                                      const RelocalizationOptions& options = {},
                                                      const std::function<bool(std::size_t)>& progress = {});

// The trials of one square of the floor and one eighth of the directions.
struct RelocalizationCell {
  Eigen::Vector2i square =
      Eigen::Vector2i::Zero();  // steps of the side, right and ahead of the first keyframe
  int direction = 0;            // eighths of a turn to the right of the first keyframe's view, 0 to 7
  int trials = 0, found = 0;
  // The same in the map: the middle of the square at the mean height of the cameras, and the middle of the
  // directions, unit length.
  Eigen::Vector3d place = Eigen::Vector3d::Zero(), view = Eigen::Vector3d::UnitZ();
};
struct RelocalizationGrid {
  double side = 0;  // of a square, metres of the map: half the median of the mean depths
  std::vector<RelocalizationCell> cells;  // those that have trials, by square and direction
};
// up: unit length, in the map.
RelocalizationGrid MakeRelocalizationGrid(const engine::MapSnapshot& map,
                                          const std::vector<RelocalizationTrial>& trials,
                                          const Eigen::Vector3d& up);

}  // namespace docent::maps
