// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "app/cameras/head.h"
#include "engine/geometry/camera_model.h"
#include "engine/map/map_snapshot.h"

// Computes where a pan-tilt camera should look for a map. Pure computation; one thread.
namespace docent::app {

// The direction in which a map point (or the gaze point of the hand-held camera) is in the centre of the
// image, seen from the carrier.
PanTilt TowardPoint(const engine::Rigid3& carrier_from_map, const Eigen::Vector3d& point_in_map);

// The point that a camera looks at: the coordinate-wise median of the finite points among its inliers. Empty
// when there are none.
std::optional<Eigen::Vector3d> GazePoint(const engine::MapSnapshot& map,
                                         const std::vector<engine::MapPointId>& seen);

struct HeadSearchOptions {
  double yaw_sigma_rad = 0.5;    // of the carrier's unknown rotation about the vertical since the loss
  double uniform_weight = 0.15;  // weight of a uniform distribution over that rotation
  // A view is recognized from another one with a probability that falls with the rotation and the distance
  // between them (ratio of the median depth), as Gaussians of these sigmas.
  double view_rotation_sigma_rad = 0.4;
  double view_shift_sigma = 0.4;
  int sufficient_points = 60;    // points in view; fewer reduce the probability proportionally
  double max_probability = 0.5;  // of recognizing one image in the best direction
  double dwell_s = 0.3;          // time for a view in addition to the travel time
};

// The probability that an image in a direction is recognized, and the search that follows from it. The search
// keeps a distribution over the carrier's rotation since its last pose and lowers it wherever an image was
// not recognized (Stone, Theory of Optimal Search, 1975). The next direction is the one with the highest
// probability of recognition per second.
class HeadSearch {
 public:
  // carrier_from_map is the last known pose. The camera model is that of the camera on the head.
  HeadSearch(const PanTiltRange& range, const engine::CameraModel& camera, const engine::MapSnapshot& map,
             const engine::Rigid3& carrier_from_map, const HeadSearchOptions& options = {});

  // Probability that one image is recognized if the carrier has not rotated; [0, 1].
  double RecognitionProbability(const PanTilt& at) const;
  // The direction with the highest such probability, which also keeps the map in view.
  PanTilt Best() const;
  // Updates the distribution after an image taken there was not recognized.
  void AddEmptyView(const PanTilt& at);
  // The next direction to look at.
  PanTilt Next(const PanTilt& at) const;

 private:
  static constexpr int kYaws = 72;  // full circle, five degrees apart
  std::size_t Row(double tilt_rad) const;
  static std::size_t Column(double yaw_rad);
  double ProbabilityAt(double yaw_rad, double tilt_rad) const;
  // Probability of recognizing an image in every direction, averaged over the carrier's rotation; indexed
  // like probabilities_.
  std::vector<double> ExpectedProbabilities() const;

  const PanTiltRange range_;
  const HeadSearchOptions options_;
  std::vector<double> tilts_;             // rad, ascending
  std::vector<double> probabilities_;     // by tilt, then yaw
  std::vector<double> yaw_distribution_;  // distribution of the carrier's rotation to the right
};

}  // namespace docent::app
