// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "engine/geometry/sim3.h"

// Where a thing stands that a person puts at a pixel: the map knows points, not surfaces, so the surface seen
// at the pixel is worked out from the points around its ray. Pure mathematics; any thread may call it.
namespace docent::content {

struct PlacementOptions {
  double start_angle_deg = 2.0;    // half-angle of the first cone around the ray
  double widest_angle_deg = 12.0;  // the cone grows to this while it holds too few points
  int enough_points = 24;          // with so many it grows no further
  int least_points = 3;            // fewer give no answer
  int least_plane_points = 5;      // fewer on one surface give its median depth instead of a plane
  double depth_gap = 0.15;         // of the depth: a larger step in depth divides two surfaces
  double inlier_distance = 0.02;   // of the depth: how far a point may lie from its plane
  double steepest_deg = 80.0;      // planes that the ray meets more obliquely are not believed
  std::uint64_t seed = 1;
};

// The surface seen along a ray, in the map.
struct SurfaceHit {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;  // unit, towards the viewer
  bool on_plane = false;   // false: no plane was found, point at the median depth, normal along the ray
  int supporting_points = 0;
};

struct SurfaceResult {
  std::optional<SurfaceHit> hit;
  std::string reason;  // a sentence when there is no hit
};

// points_in_map: finite points in view of the camera, metres. ray_origin and ray_direction (any length but
// zero) in the map. Of several surfaces at different depths the nearest one that the ray goes through is
// taken.
SurfaceResult FindSurface(std::span<const Eigen::Vector3d> points_in_map, const Eigen::Vector3d& ray_origin,
                          const Eigen::Vector3d& ray_direction, const PlacementOptions& options = {});

// map_from_model of a model (y up, foot at its origin, front along z) that stands at `point` with its y axis
// along map_up. Its front looks where the surface faces, or, on level ground, in a direction fixed by map_up
// alone; then it is turned by yaw (radians, counter-clockwise seen from above). With map_up zero the normal
// is up.
engine::Sim3 UprightPose(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                         const Eigen::Vector3d& map_up, double yaw, double scale);

}  // namespace docent::content
