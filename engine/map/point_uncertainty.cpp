// SPDX-License-Identifier: Apache-2.0
#include "engine/map/point_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace docent::engine {

namespace {

// Information of an observation on the point's position in the map; zero if the point does not project.
Eigen::Matrix3d InformationOf(const KeyFrame& keyframe, const Eigen::Vector3d& position, int level) {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> pixel_from_camera;
  if (!keyframe.camera->Project(keyframe.camera_from_map * position, &pixel, &pixel_from_camera))
    return Eigen::Matrix3d::Zero();
  const Eigen::Matrix<double, 2, 3> jacobian =
      pixel_from_camera * keyframe.camera_from_map.rotation.matrix() / static_cast<double>(1 << level);
  return jacobian.transpose() * jacobian;
}

float RelativeDeviation(const Eigen::Matrix3d& information, const Eigen::Vector3d& line_of_sight) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  const double distance = line_of_sight.norm();
  const Eigen::LDLT<Eigen::Matrix3d> factors(information);
  const Eigen::Vector3d pivots = factors.vectorD();
  if (!(distance > 0) || !(pivots.minCoeff() > 1e-12 * pivots.maxCoeff())) return kNone;
  const Eigen::Vector3d along = line_of_sight / distance;
  const double variance = along.dot(factors.solve(along));
  return variance > 0 ? static_cast<float>(std::sqrt(variance) / distance) : kNone;
}

}  // namespace

std::vector<float> RelativeDepthDeviations(const MapSnapshot& map, double pixel_sigma) {
  std::vector<Eigen::Matrix3d> information(map.points.size(), Eigen::Matrix3d::Zero());
  const KeyFrame* keyframe = nullptr;
  for (const Observation& observation : map.observations) {
    if (!keyframe || keyframe->id != observation.keyframe) keyframe = map.FindKeyFrame(observation.keyframe);
    const MapPoint* const point = map.FindPoint(observation.point);
    if (!keyframe || !point || point->infinite() || keyframe->kind != KeyFrameKind::kSixDof) continue;
    information[static_cast<std::size_t>(point - map.points.data())] +=
        InformationOf(*keyframe, point->position(), observation.level);
  }
  std::vector<float> deviations(map.points.size(), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const KeyFrame* const source = map.FindKeyFrame(map.points[i].source_keyframe);
    if (!source || map.points[i].infinite()) continue;
    const Eigen::Vector3d sight = map.points[i].position() - source->camera_from_map.OriginInSource();
    deviations[i] = static_cast<float>(pixel_sigma) * RelativeDeviation(information[i], sight);
  }
  return deviations;
}

}  // namespace docent::engine
