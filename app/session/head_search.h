// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "app/cameras/head.h"
#include "engine/geometry/camera_model.h"
#include "engine/map/map_snapshot.h"

// Where a camera that can turn its head should look, by what the map knows. Pure computation; one thread.
namespace docent::app {

// From where the carrier is, the direction in which a point of the map (or what the hand-held camera looks
// at) is in the middle of the image.
PanTilt TowardPoint(const engine::Rigid3& carrier_from_map, const Eigen::Vector3d& point_in_map);

// What a camera looks at: the median of the points that it is tracked by and that have a place. Empty
// without.
std::optional<Eigen::Vector3d> GazePoint(const engine::MapSnapshot& map,
                                         const std::vector<engine::MapPointId>& seen);

struct HeadSearchOptions {
  double turn_sigma_rad = 0.5;  // how far the carrier may have turned about the vertical when it was lost
  double anywhere = 0.15;       // odds that it turned by anything at all
  double likeness_rad = 0.4;  // views turned this far apart still look alike enough to be found in most cases
  double likeness_shift = 0.4;  // the same for their distance, in depths of what they see
  int enough_points = 60;       // in the image; fewer lower the odds
  double best_odds = 0.5;       // of one image in the best direction
  double dwell_s = 0.3;         // what looking costs besides the way there
};

// How likely an image in a direction is to be recognised, and the search that follows from it: a belief over
// how far the carrier has turned since it was known, lowered wherever an image found nothing (Stone, Theory
// of Optimal Search, 1975), and as the next direction always the one that finds the map soonest in
// expectation.
class HeadSearch {
 public:
  // carrier_from_map: the last that was known. The lens must be that of the camera on the head.
  HeadSearch(const PanTiltRange& range, const engine::CameraModel& camera, const engine::MapSnapshot& map,
             const engine::Rigid3& carrier_from_map, const HeadSearchOptions& options = {});

  // The odds of one image, the carrier not having turned; [0, 1].
  double Odds(const PanTilt& at) const;
  // Where the map is seen best if the carrier has not turned: also what keeps the map in view.
  PanTilt Best() const;
  // An image taken there was not recognised.
  void AddEmptyView(const PanTilt& at);
  // Where to look next.
  PanTilt Next(const PanTilt& at) const;

 private:
  static constexpr int kYaws = 72;  // all around, five degrees apart
  std::size_t Row(double tilt_rad) const;
  static std::size_t Column(double yaw_rad);
  double OddsIn(double yaw_rad, double tilt_rad) const;
  // Of one image in every direction, as odds_.
  std::vector<double> Expected() const;

  const PanTiltRange range_;
  const HeadSearchOptions options_;
  std::vector<double> tilts_;   // rad, ascending
  std::vector<double> odds_;    // by tilt, then yaw
  std::vector<double> belief_;  // by how far the carrier turned to the right
};

}  // namespace docent::app
