// SPDX-License-Identifier: Apache-2.0
#include "content/placement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "content/warp.h"
#include "engine/geometry/triangulation.h"

namespace docent::content {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// A map point in coordinates of the ray.
struct Neighbour {
  Eigen::Vector3d point;
  double depth;            // Along the ray, in map units.
  Eigen::Vector2d offset;  // OrthogonalAxes the ray, divided by the depth: its length is the tangent of the
                           // angle to the ray.
};

// Two unit vectors that form a right-handed frame with a unit vector.
void OrthogonalAxes(const Eigen::Vector3d& axis, Eigen::Vector3d* first, Eigen::Vector3d* second) {
  Eigen::Index smallest;
  axis.cwiseAbs().minCoeff(&smallest);
  *first = axis.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  *second = axis.cross(*first);
}

// The points inside the narrowest cone that contains enough of them, ordered by depth.
std::vector<Neighbour> PointsNearRay(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& origin,
                                     const Eigen::Vector3d& ray, const PlacementOptions& options) {
  Eigen::Vector3d right, down;
  OrthogonalAxes(ray, &right, &down);
  std::vector<Neighbour> found;
  const double widest = std::tan(options.max_cone_deg * kDegree);
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
  const double start = std::tan(options.initial_cone_deg * kDegree);
  std::size_t kept = 0;
  while (kept < found.size() &&
         (found[kept].offset.norm() <= start || kept < static_cast<std::size_t>(options.sufficient_points))) {
    ++kept;
  }
  found.resize(kept);
  std::stable_sort(found.begin(), found.end(),
                   [](const Neighbour& a, const Neighbour& b) { return a.depth < b.depth; });
  return found;
}

// Whether the points surround the ray as seen from the viewer: every half-plane through the ray contains a
// point.
bool Surrounds(std::span<const Neighbour> points) {
  std::vector<double> angles;
  for (const Neighbour& point : points) angles.push_back(std::atan2(point.offset.y(), point.offset.x()));
  std::sort(angles.begin(), angles.end());
  double widest_gap = 2 * std::numbers::pi - (angles.back() - angles.front());
  for (std::size_t i = 1; i < angles.size(); ++i)
    widest_gap = std::max(widest_gap, angles[i] - angles[i - 1]);
  return widest_gap < std::numbers::pi;
}

double SmallestOffset(std::span<const Neighbour> points) {
  double least = std::numeric_limits<double>::infinity();
  for (const Neighbour& point : points) least = std::min(least, point.offset.norm());
  return least;
}

// Points sorted by depth are divided into surfaces at the gaps.
std::vector<std::span<const Neighbour>> DivideIntoSurfaces(std::span<const Neighbour> points,
                                                           const PlacementOptions& options) {
  std::vector<std::span<const Neighbour>> surfaces;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= points.size(); ++i) {
    const bool ends = i == points.size() || points[i].depth > points[i - 1].depth * (1 + options.depth_gap);
    if (!ends) continue;
    const std::span<const Neighbour> surface = points.subspan(begin, i - begin);
    begin = i;
    if (surface.size() >= static_cast<std::size_t>(options.min_points)) surfaces.push_back(surface);
  }
  return surfaces;
}

// The surface that the ray hits: the nearest one that surrounds the ray. If there is none, the ray passes
// beside all of them, and the surface closest to it is used.
std::span<const Neighbour> FrontSurface(std::span<const Neighbour> points, const PlacementOptions& options) {
  std::span<const Neighbour> closest;
  for (const std::span<const Neighbour> surface : DivideIntoSurfaces(points, options)) {
    if (Surrounds(surface)) return surface;
    if (closest.empty() || SmallestOffset(surface) < SmallestOffset(closest)) closest = surface;
  }
  return closest;
}

// The intersection of the ray with a plane fitted to these points. Empty when no plane fits, the incidence is
// too oblique, or the intersection is far from the points.
std::optional<SurfaceHit> HitPlane(std::span<const Neighbour> surface, const Eigen::Vector3d& origin,
                                   const Eigen::Vector3d& ray, const PlacementOptions& options) {
  if (surface.size() < static_cast<std::size_t>(options.min_plane_points)) return std::nullopt;
  std::vector<Eigen::Vector3d> points;
  for (const Neighbour& neighbour : surface) points.push_back(neighbour.point);
  const double median_depth = surface[surface.size() / 2].depth;
  const auto fit = engine::FitPlane(points, options.inlier_distance * median_depth, options.seed);
  if (!fit || fit->inliers < options.min_plane_points || 2 * fit->inliers < static_cast<int>(points.size())) {
    return std::nullopt;
  }
  const double along = fit->plane.normal.dot(ray);
  if (std::abs(along) < std::cos(options.max_incidence_deg * kDegree)) return std::nullopt;
  const double depth = -fit->plane.SignedDistance(origin) / along;
  // If all points lie on one side of the ray, the plane's intersection may be far from all of them.
  const double slack = options.depth_gap * median_depth;
  if (depth < surface.front().depth - slack || depth > surface.back().depth + slack) return std::nullopt;
  SurfaceHit hit;
  hit.point = origin + depth * ray;
  hit.normal = along < 0 ? fit->plane.normal : Eigen::Vector3d(-fit->plane.normal);
  hit.on_plane = true;
  hit.supporting_points = fit->inliers;
  return hit;
}

// The hit at a measured distance. The normal is that of the plane that passes closest to it: of one surface's
// points, or of all points at about this distance.
SurfaceHit HitAt(double distance, std::span<const Neighbour> near, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& ray, const PlacementOptions& options) {
  std::vector<std::span<const Neighbour>> surfaces = DivideIntoSurfaces(near, options);
  const auto first = std::find_if(near.begin(), near.end(), [&](const Neighbour& point) {
    return point.depth > distance * (1 - options.depth_gap);
  });
  const auto end = std::find_if(first, near.end(), [&](const Neighbour& point) {
    return point.depth > distance * (1 + options.depth_gap);
  });
  surfaces.emplace_back(first, end);
  SurfaceHit hit;
  hit.normal = -ray;
  double least = options.agreement * distance;
  for (const std::span<const Neighbour> surface : surfaces) {
    const auto plane = HitPlane(surface, origin, ray, options);
    const double off = plane ? std::abs((plane->point - origin).dot(ray) - distance) : least;
    if (off >= least) continue;
    least = off;
    hit = *plane;
  }
  hit.point = origin + distance * ray;
  return hit;
}

}  // namespace

SurfaceResult FindSurface(std::span<const Eigen::Vector3d> points_in_map, const Eigen::Vector3d& ray_origin,
                          const Eigen::Vector3d& ray_direction, const PlacementOptions& options,
                          std::optional<double> distance) {
  if (!ray_origin.allFinite() || !ray_direction.allFinite() || !(ray_direction.norm() > 0)) {
    return {std::nullopt,
            "The lens does not see anything at this pixel; choose one nearer to the middle of the image."};
  }
  const Eigen::Vector3d ray = ray_direction.normalized();
  const std::vector<Neighbour> near = PointsNearRay(points_in_map, ray_origin, ray, options);
  if (distance && *distance > 0) return {HitAt(*distance, near, ray_origin, ray, options), ""};
  if (near.empty())
    return {std::nullopt, "The map has no points near this pixel; choose a place with more detail."};
  if (near.size() < static_cast<std::size_t>(options.min_points)) {
    return {std::nullopt, "The map has too few points near this pixel; choose a place with more detail."};
  }
  std::span<const Neighbour> surface = FrontSurface(near, options);
  if (surface.empty())
    surface = near;  // The points are too scattered for surfaces; the median depth of all is used.
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
    OrthogonalAxes(up, &front, &unused);
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

engine::Sim3 FacingPose(const Eigen::Vector3d& point, const Eigen::Vector3d& viewer,
                        const Eigen::Vector3d& normal, const Eigen::Vector3d& map_up, double yaw,
                        double scale) {
  constexpr double kMinLevelPart = 0.05;  // Ratio; within 3 degrees of the vertical there is no direction.
  const Eigen::Vector3d up = (map_up.norm() > 0 ? map_up : normal).normalized();
  const Eigen::Vector3d to_viewer = viewer - point;
  const Eigen::Vector3d level = to_viewer - up * up.dot(to_viewer);
  const bool is_level = level.norm() > kMinLevelPart * to_viewer.norm();
  return UprightPose(point, is_level ? level.normalized() : normal, up, yaw, scale);
}

engine::Sim3 FlushPose(const Eigen::Vector3d& point, const Eigen::Vector3d& viewer,
                       const Eigen::Vector3d& normal, const Eigen::Vector3d& map_up, double scale) {
  constexpr double kMinUprightPart = 0.1;  // Within 6 degrees of level ground, up is mostly noise.
  const Eigen::Vector3d front = normal.normalized();
  const auto across = [&](const Eigen::Vector3d& direction) -> Eigen::Vector3d {
    return direction - front * front.dot(direction);
  };
  Eigen::Vector3d top = across(map_up);
  if (!(top.norm() > kMinUprightPart * map_up.norm())) top = across(point - viewer);
  if (!(top.norm() > 1e-6 * (point - viewer).norm())) top = front.unitOrthogonal();
  top.normalize();
  Eigen::Matrix3d axes;
  axes << top.cross(front), top, front;
  return {engine::Rotation3(axes), point, scale};
}

Eigen::Vector3d BaseOf(const Model& model) {
  const glm::vec3 &least = model.bounds_min, &most = model.bounds_max;
  return {0.5 * (static_cast<double>(least.x) + static_cast<double>(most.x)), static_cast<double>(least.y),
          0.5 * (static_cast<double>(least.z) + static_cast<double>(most.z))};
}

Eigen::Vector3d BaseInMap(const Entity& entity) {
  if (!HasModel(entity)) return PlaceOf(entity);
  const std::shared_ptr<const Asset>& asset = entity.model.asset;
  if (!asset || !asset->model) return entity.model.map_from_model.translation;
  const Eigen::Vector3d base = BaseOf(*asset->model);
  return entity.model.map_from_model * (entity.model.warp ? (*entity.model.warp)(base) : base);
}

double ScaleForSide(const Model& model, double side) {
  const glm::vec3 extent = model.bounds_max - model.bounds_min;
  const double largest = static_cast<double>(std::max({extent.x, extent.y, extent.z}));
  if (!(largest > 0) || !std::isfinite(largest)) return 1;
  return std::clamp(side / largest, kMinModelScale, kMaxModelScale);
}

double AutomaticScale(const Model& model, const MapSettings& settings, double side) {
  if (settings.metres_per_unit == 0) return ScaleForSide(model, side);
  return std::clamp(1 / settings.metres_per_unit, kMinModelScale, kMaxModelScale);
}

}  // namespace docent::content
