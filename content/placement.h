// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "content/scene.h"
#include "engine/geometry/sim3.h"

// Computes the pose of an entity that a person places at a pixel. A map has points and no surfaces, so the
// surface at the pixel is estimated from the map points around its ray. Pure functions; thread-safe.
namespace docent::content {

// How FindSurface chooses among the points.
struct PlacementOptions {
  double initial_cone_deg = 2.0;  // Half-angle of the initial cone around the ray.
  double max_cone_deg = 12.0;     // The cone is widened up to this until it contains enough points.
  int sufficient_points = 24;     // The cone is not widened if it contains this many points.
  int min_points = 3;             // With fewer points there is no result.
  int min_plane_points = 5;       // With fewer points the surface's median depth is used instead of a plane.
  double depth_gap = 0.15;        // Ratio of the depth: a larger step in depth separates two surfaces.
  double inlier_distance = 0.02;  // Ratio of the depth: largest distance of an inlier from the plane.
  double agreement = 0.05;        // Ratio of a measured distance: a plane this close to it is its surface.
  double max_incidence_deg = 80.0;  // Planes with a larger angle between normal and ray are rejected.
  std::uint64_t seed = 1;           // Of the random choices of the robust plane fit.
};

// The surface that a ray hits, in the map.
struct SurfaceHit {
  Eigen::Vector3d point;   // Map units.
  Eigen::Vector3d normal;  // Unit vector towards the viewer.
  // False without a plane: the point is at the median depth and the normal opposes the ray.
  bool on_plane = false;
  int supporting_points = 0;  // Number of map points that the plane or depth was estimated from.
};

// A hit, or why there is none.
struct SurfaceResult {
  std::optional<SurfaceHit> hit;  // Empty where the points show no surface.
  std::string reason;             // Why there is no hit, as a sentence.
};

// points_in_map are finite points in the camera's view. ray_origin and ray_direction (any nonzero length) are
// in the map. Among several surfaces at different depths, the nearest one that the ray passes through is
// used, or the one at `distance` along the ray, if that was measured: the hit is at this distance then.
SurfaceResult FindSurface(std::span<const Eigen::Vector3d> points_in_map, const Eigen::Vector3d& ray_origin,
                          const Eigen::Vector3d& ray_direction, const PlacementOptions& options = {},
                          std::optional<double> distance = std::nullopt);

// Returns the map_from_model of a model (y up, foot at its origin, front along z) that stands at `point` with
// its y axis along map_up. Its front faces along the horizontal part of the surface normal or, on nearly
// level ground, in a fixed direction that depends only on map_up. It is then rotated by yaw (radians,
// counter-clockwise seen from above). If map_up is zero, the normal is up.
engine::Sim3 UprightPose(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                         const Eigen::Vector3d& map_up, double yaw, double scale);

// The same, but the front faces the viewer, whose position is in the map. Where the viewer looks straight
// down or up at the point, the front faces as UprightPose has it.
engine::Sim3 FacingPose(const Eigen::Vector3d& point, const Eigen::Vector3d& viewer,
                        const Eigen::Vector3d& normal, const Eigen::Vector3d& map_up, double yaw,
                        double scale);

// The middle of the bottom of a model's bounding box, in model axes and metres: the point that stands on a
// surface.
Eigen::Vector3d BaseOf(const Model& model);
// The pose of an image that lies flush with a surface: its middle at `point`, its front along the surface's
// normal, and upright as far as that allows. On level ground, its upper side points away from the viewer.
engine::Sim3 FlushPose(const Eigen::Vector3d& point, const Eigen::Vector3d& viewer,
                       const Eigen::Vector3d& normal, const Eigen::Vector3d& map_up, double scale);

// Where the base of an entity is in the map: the base of its model (its origin, if the model is not loaded),
// or the place of an entity of another kind (PlaceOf).
Eigen::Vector3d BaseInMap(const Entity& entity);

// The scale, in map units per metre, at which the largest side of the model has this length in map units,
// within the limits of a scene; 1 for a model without extent.
double ScaleForSide(const Model& model, double side);
// The scale of a model that is placed without one: its true size where the length of a map unit is known,
// else ScaleForSide.
double AutomaticScale(const Model& model, const MapSettings& settings, double side);

}  // namespace docent::content
