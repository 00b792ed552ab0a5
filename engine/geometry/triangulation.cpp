// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/triangulation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

constexpr int kMaxPlaneSamples = 500;
constexpr double kPlaneConfidence = 0.9999;
constexpr int kPlaneRefinements = 10;
// A triangle or cloud counts as a line if its height is below this ratio of its longest side, or its second
// spread below this ratio of its first.
constexpr double kCollinearRatio = 1e-6;

std::optional<Plane> PlaneThrough(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double longest_squared = std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()});
  const double norm = normal.norm();
  if (!(norm > kCollinearRatio * longest_squared)) {
    return std::nullopt;
  }
  return Plane{normal / norm, -normal.dot(a) / norm};
}

// Total least squares over the points near `start`.
std::optional<Plane> RefinePlane(std::span<const Eigen::Vector3d> points, const Plane& start,
                                 double inlier_distance) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Eigen::Vector3d& point : points) {
    if (std::abs(start.SignedDistance(point)) < inlier_distance) {
      mean += point;
      ++count;
    }
  }
  if (count < 3) {
    return std::nullopt;
  }
  mean /= count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    if (std::abs(start.SignedDistance(point)) < inlier_distance) {
      scatter += (point - mean) * (point - mean).transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  if (!(solver.eigenvalues()[1] > kCollinearRatio * kCollinearRatio * solver.eigenvalues()[2])) {
    return std::nullopt;
  }
  const Eigen::Vector3d normal = solver.eigenvectors().col(0).normalized();
  return Plane{normal, -normal.dot(mean)};
}

// A plane with the sum of its squared distances, each truncated at the inlier distance (Torr and Zisserman
// 2000). In contrast to the number of inliers, refining the plane on its inliers can only decrease it.
struct ScoredPlane {
  PlaneFit fit;
  double cost = 0;
};

ScoredPlane Score(std::span<const Eigen::Vector3d> points, const Plane& plane, double inlier_distance) {
  ScoredPlane result{{plane, 0}, 0};
  for (const Eigen::Vector3d& point : points) {
    const double distance = std::abs(plane.SignedDistance(point));
    const bool is_inlier = distance < inlier_distance;
    result.fit.inliers += is_inlier ? 1 : 0;
    result.cost += is_inlier ? distance * distance : inlier_distance * inlier_distance;
  }
  return result;
}

// Number of samples of three that contains one without outliers at the given confidence and inlier ratio.
double SamplesNeeded(double inlier_ratio) {
  const double good = std::pow(inlier_ratio, 3);
  return good >= 1.0 ? 1.0 : std::log(1 - kPlaneConfidence) / std::log1p(-good);
}

}  // namespace

std::optional<Eigen::Vector3d> Triangulate(const Eigen::Vector3d& ray_in_a, const Eigen::Vector3d& ray_in_b,
                                           const Rigid3& b_from_a) {
  const Eigen::Vector3d center_b = b_from_a.OriginInSource();
  const Eigen::Vector3d direction_b = b_from_a.rotation.inverse() * ray_in_b;
  const Eigen::Vector3d common_normal = ray_in_a.cross(direction_b);
  const double sine_squared = common_normal.squaredNorm();
  if (!(sine_squared > 1e-18)) {
    return std::nullopt;
  }
  // Depths of the closest points of the two rays.
  const double depth_a = center_b.cross(direction_b).dot(common_normal) / sine_squared;
  const double depth_b = center_b.cross(ray_in_a).dot(common_normal) / sine_squared;
  if (!(depth_a > 0) || !(depth_b > 0)) {
    return std::nullopt;
  }
  // The angular error of a point between them is (its distance to a ray) / depth; the sum of the squared
  // angles is smallest with weights 1 / depth^2.
  const double weight_a = 1.0 / (depth_a * depth_a), weight_b = 1.0 / (depth_b * depth_b);
  const Eigen::Vector3d point =
      (weight_a * (depth_a * ray_in_a) + weight_b * (center_b + depth_b * direction_b)) /
      (weight_a + weight_b);
  if (!point.allFinite()) {
    return std::nullopt;
  }
  return point;
}

double ParallaxAngle(const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b,
                     const Eigen::Vector3d& point) {
  const Eigen::Vector3d ray_a = point - center_a, ray_b = point - center_b;
  return std::atan2(ray_a.cross(ray_b).norm(), ray_a.dot(ray_b));
}

std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points, double inlier_distance,
                                 std::uint64_t seed) {
  if (points.size() < 3) {
    return std::nullopt;
  }
  Random random(seed);
  const auto count = static_cast<std::uint32_t>(points.size());
  std::optional<ScoredPlane> best;
  double samples_needed = kMaxPlaneSamples;
  for (int sample = 0; sample < samples_needed; ++sample) {
    const std::optional<Plane> plane =
        PlaneThrough(points[random.Below(count)], points[random.Below(count)], points[random.Below(count)]);
    if (!plane) {
      continue;
    }
    const ScoredPlane scored = Score(points, *plane, inlier_distance);
    if (!best || scored.cost < best->cost) {
      best = scored;
      samples_needed =
          std::min<double>(kMaxPlaneSamples, SamplesNeeded(static_cast<double>(scored.fit.inliers) / count));
    }
  }
  for (int i = 0; best && i < kPlaneRefinements; ++i) {
    const std::optional<Plane> refined = RefinePlane(points, best->fit.plane, inlier_distance);
    if (!refined) {
      break;
    }
    const ScoredPlane scored = Score(points, *refined, inlier_distance);
    if (!(scored.cost < best->cost)) {
      break;
    }
    best = scored;
  }
  if (!best) {
    return std::nullopt;
  }
  return best->fit;
}

}  // namespace docent::engine
