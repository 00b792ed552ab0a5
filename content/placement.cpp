// SPDX-License-Identifier: Apache-2.0
#include "content/placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "engine/geometry/triangulation.h"

namespace docent::content {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// A map point as the ray sees it.
struct Neighbour {
  Eigen::Vector3d point;
  double depth;            // along the ray, metres
  Eigen::Vector2d offset;  // across the ray over depth: its length is the tangent of the angle to the ray
};

// Two unit vectors that make a right-handed frame with a unit vector.
void Across(const Eigen::Vector3d& axis, Eigen::Vector3d* first, Eigen::Vector3d* second) {
  Eigen::Index smallest;
  axis.cwiseAbs().minCoeff(&smallest);
  *first = axis.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  *second = axis.cross(*first);
}

// The points inside the narrowest cone that holds enough of them, nearest first.
std::vector<Neighbour> PointsNearRay(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& origin,
                                     const Eigen::Vector3d& ray, const PlacementOptions& options) {
  Eigen::Vector3d right, down;
  Across(ray, &right, &down);
  std::vector<Neighbour> found;
  const double widest = std::tan(options.widest_angle_deg * kDegree);
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d from_origin = point - origin;
    const double depth = ray.dot(from_origin);
    if (!(depth > 0)) continue;
    const Eigen::Vector2d offset(right.dot(from_origin) / depth, down.dot(from_origin) / depth);
    if (offset.norm() <= widest) found.push_back({point, depth, offset});
  }
  std::sort(found.begin(), found.end(), [](const Neighbour& a, const Neighbour& b) {
    return a.offset.squaredNorm() < b.offset.squaredNorm();
  });
  const double start = std::tan(options.start_angle_deg * kDegree);
  std::size_t kept = 0;
  while (kept < found.size() &&
         (found[kept].offset.norm() <= start || kept < static_cast<std::size_t>(options.enough_points))) {
    ++kept;
  }
  found.resize(kept);
  std::stable_sort(found.begin(), found.end(),
                   [](const Neighbour& a, const Neighbour& b) { return a.depth < b.depth; });
  return found;
}

// Whether the ray passes between the points, seen from the viewer: no half-plane through the ray is free of
// them.
bool Surrounds(std::span<const Neighbour> points) {
  std::vector<double> angles;
  for (const Neighbour& point : points) angles.push_back(std::atan2(point.offset.y(), point.offset.x()));
  std::sort(angles.begin(), angles.end());
  double widest_gap = 2 * std::numbers::pi - (angles.back() - angles.front());
  for (std::size_t i = 1; i < angles.size(); ++i)
    widest_gap = std::max(widest_gap, angles[i] - angles[i - 1]);
  return widest_gap < std::numbers::pi;
}

double LeastOffset(std::span<const Neighbour> points) {
  double least = std::numeric_limits<double>::infinity();
  for (const Neighbour& point : points) least = std::min(least, point.offset.norm());
  return least;
}

// The surface that the ray meets. Points sorted by depth fall into surfaces at the gaps; the nearest that
// surrounds the ray is in front. If none does, the ray passes beside them all, and the one closest to it is
// taken.
std::span<const Neighbour> FrontSurface(std::span<const Neighbour> points, const PlacementOptions& options) {
  std::span<const Neighbour> closest;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= points.size(); ++i) {
    const bool ends = i == points.size() || points[i].depth > points[i - 1].depth * (1 + options.depth_gap);
    if (!ends) continue;
    const std::span<const Neighbour> surface = points.subspan(begin, i - begin);
    begin = i;
    if (surface.size() < static_cast<std::size_t>(options.least_points)) continue;
    if (Surrounds(surface)) return surface;
    if (closest.empty() || LeastOffset(surface) < LeastOffset(closest)) closest = surface;
  }
  return closest;
}

// The ray's point on the plane of these points; empty where no plane fits or it is met too obliquely or far
// off.
std::optional<SurfaceHit> HitPlane(std::span<const Neighbour> surface, const Eigen::Vector3d& origin,
                                   const Eigen::Vector3d& ray, const PlacementOptions& options) {
  if (surface.size() < static_cast<std::size_t>(options.least_plane_points)) return std::nullopt;
  std::vector<Eigen::Vector3d> points;
  for (const Neighbour& neighbour : surface) points.push_back(neighbour.point);
  const double median_depth = surface[surface.size() / 2].depth;
  const auto fit = engine::FitPlane(points, options.inlier_distance * median_depth, options.seed);
  if (!fit || fit->inliers < options.least_plane_points ||
      2 * fit->inliers < static_cast<int>(points.size())) {
    return std::nullopt;
  }
  const double along = fit->plane.normal.dot(ray);
  if (std::abs(along) < std::cos(options.steepest_deg * kDegree)) return std::nullopt;
  const double depth = -fit->plane.SignedDistance(origin) / along;
  // A plane through one-sided points may be met far from all of them.
  const double slack = options.depth_gap * median_depth;
  if (depth < surface.front().depth - slack || depth > surface.back().depth + slack) return std::nullopt;
  SurfaceHit hit;
  hit.point = origin + depth * ray;
  hit.normal = along < 0 ? fit->plane.normal : Eigen::Vector3d(-fit->plane.normal);
  hit.on_plane = true;
  hit.supporting_points = fit->inliers;
  return hit;
}

}  // namespace

SurfaceResult FindSurface(std::span<const Eigen::Vector3d> points_in_map, const Eigen::Vector3d& ray_origin,
                          const Eigen::Vector3d& ray_direction, const PlacementOptions& options) {
  if (!ray_origin.allFinite() || !ray_direction.allFinite() || !(ray_direction.norm() > 0)) {
    return {std::nullopt, "The pixel has no ray."};
  }
  const Eigen::Vector3d ray = ray_direction.normalized();
  const std::vector<Neighbour> near = PointsNearRay(points_in_map, ray_origin, ray, options);
  if (near.empty()) return {std::nullopt, "The map has no point near this pixel."};
  if (near.size() < static_cast<std::size_t>(options.least_points)) {
    return {std::nullopt, "The map has too few points near this pixel."};
  }
  std::span<const Neighbour> surface = FrontSurface(near, options);
  if (surface.empty()) surface = near;  // too scattered in depth for a surface: the median of all
  if (const std::optional<SurfaceHit> hit = HitPlane(surface, ray_origin, ray, options)) return {hit, ""};
  SurfaceHit hit;
  hit.point = ray_origin + surface[surface.size() / 2].depth * ray;
  hit.normal = -ray;
  hit.supporting_points = static_cast<int>(surface.size());
  return {hit, ""};
}

engine::Sim3 UprightPose(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                         const Eigen::Vector3d& map_up, double yaw, double scale) {
  Eigen::Vector3d up = map_up.norm() > 0 ? map_up : normal;
  up = up.norm() > 0 ? Eigen::Vector3d(up.normalized()) : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
  Eigen::Vector3d front = normal - up * up.dot(normal);
  // Within 30 degrees of level ground the direction of the slope is mostly noise.
  if (front.norm() < 0.5) {
    Eigen::Vector3d unused;
    Across(up, &front, &unused);
  }
  front.normalize();
  Eigen::Matrix3d axes;
  axes.col(0) = up.cross(front);
  axes.col(1) = up;
  axes.col(2) = front;
  engine::Sim3 map_from_model;
  map_from_model.rotation = engine::Rotation3(axes) * engine::Rotation3::Exp(Eigen::Vector3d::UnitY() * yaw);
  map_from_model.translation = point;
  map_from_model.scale = scale;
  return map_from_model;
}

}  // namespace docent::content
