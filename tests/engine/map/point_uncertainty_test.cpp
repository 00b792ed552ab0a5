// SPDX-License-Identifier: Apache-2.0
#include "engine/map/point_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/random.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;

// Keyframes at these centres with their optical axes along z, and one point that all of them observe.
MapSnapshot MapOfOnePoint(const Eigen::Vector3d& position, const std::vector<Eigen::Vector3d>& centers,
                          int level) {
  MapSnapshot map;
  MapPoint point;
  point.id = 7;
  point.point_in_map.head<3>() = position;
  point.source_keyframe = 0;
  map.points.push_back(point);
  for (const Eigen::Vector3d& center : centers) {
    KeyFrame keyframe = BlankKeyFrame(Rigid3(Rotation3(), -center));
    keyframe.id = static_cast<KeyFrameId>(map.keyframes.size());
    map.observations.push_back({keyframe.id, point.id,
                                keyframe.camera->Project(position - center)->cast<float>(),
                                static_cast<std::uint8_t>(level)});
    map.keyframes.push_back(keyframe);
  }
  return map;
}

// Two views side by side and a point at depth z in front of the middle of their baseline b, nearly on the
// optical axes: sigma_z / z = sqrt(2) sigma z / (f b).
TEST(PointUncertainty, OfTwoViewsFollowsTheStereoFormula) {
  constexpr double kBaseline = 0.02, kDepth = 2.0, kSigma = 0.5;
  const MapSnapshot map = MapOfOnePoint({kBaseline / 2, 0, kDepth}, {{0, 0, 0}, {kBaseline, 0, 0}}, 0);
  const double focal = 1.0 / map.keyframes[0].camera->PixelAngle();
  const double expected = std::sqrt(2.0) * kSigma * kDepth / (focal * kBaseline);
  EXPECT_NEAR(RelativeDepthDeviations(map, kSigma).at(0), expected, 1e-3 * expected);
}

TEST(PointUncertainty, DoublesPerPyramidLevelAndHalvesWithFourTimesTheViews) {
  const std::vector<Eigen::Vector3d> two = {{0, 0, 0}, {0.1, 0, 0}};
  std::vector<Eigen::Vector3d> eight;
  for (int i = 0; i < 4; ++i) eight.insert(eight.end(), two.begin(), two.end());
  const Eigen::Vector3d position(0.05, 0, 2);
  const float once = RelativeDepthDeviations(MapOfOnePoint(position, two, 0)).at(0);
  EXPECT_NEAR(RelativeDepthDeviations(MapOfOnePoint(position, two, 2)).at(0), 4 * once, 1e-4 * once);
  EXPECT_NEAR(RelativeDepthDeviations(MapOfOnePoint(position, eight, 0)).at(0), once / 2, 1e-4 * once);
}

// The predicted deviation must equal the empirical deviation of depths triangulated from noisy measurements.
TEST(PointUncertainty, EqualsTheDeviationOfTriangulatedDepths) {
  constexpr double kSigma = 0.5;
  constexpr int kTrials = 4000;
  const Eigen::Vector3d position(0.2, -0.1, 2);
  const MapSnapshot map = MapOfOnePoint(position, {{0, 0, 0}, {0.5, 0.1, 0}}, 0);
  const CameraModel& camera = *map.keyframes[0].camera;
  const Rigid3& b_from_map = map.keyframes[1].camera_from_map;
  Random random(5);
  double squares = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    // The sum of twelve uniform numbers is close to Gaussian, with unit variance.
    const auto noise = [&] {
      double sum = -6;
      for (int i = 0; i < 12; ++i) sum += random.Uniform();
      return kSigma * sum;
    };
    const auto noisy = [&](const Eigen::Vector3d& in_camera) {
      return *camera.Unproject(*camera.Project(in_camera) + Eigen::Vector2d(noise(), noise()));
    };
    const Eigen::Vector3d a = noisy(position),
                          b = b_from_map.rotation.inverse() * noisy(b_from_map * position);
    // The point on ray a that is nearest to ray b, which starts at centre c.
    const Eigen::Vector3d c = b_from_map.OriginInSource(), normal = a.cross(b).cross(b);
    squares += std::pow(c.dot(normal) / a.dot(normal) * a.norm() / position.norm() - 1, 2);
  }
  const double scatter = std::sqrt(squares / kTrials);
  EXPECT_NEAR(RelativeDepthDeviations(map, kSigma).at(0), scatter, 0.08 * scatter);
}

TEST(PointUncertainty, IsInfiniteWhereDepthIsUnobservable) {
  EXPECT_TRUE(std::isinf(RelativeDepthDeviations(MapOfOnePoint({0, 0, 2}, {{0, 0, 0}}, 0)).at(0)))
      << "one view";
  EXPECT_TRUE(std::isinf(RelativeDepthDeviations(MapOfOnePoint({0, 0, 2}, {{0, 0, 0}, {0, 0, 0}}, 0)).at(0)))
      << "two views without a baseline";
  MapSnapshot direction = MapOfOnePoint({0, 0, 1}, {{0, 0, 0}}, 0);
  direction.points[0].point_in_map[3] = 0;
  EXPECT_TRUE(std::isinf(RelativeDepthDeviations(direction).at(0))) << "an infinite point";
}

}  // namespace
}  // namespace docent::engine
