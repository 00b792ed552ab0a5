// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/track_readout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/random.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;

using CameraPath = std::function<Rigid3(double)>;  // camera from world, by the time in seconds

// A hand that sways: it turns by up to 0.5 radians per second and moves by 0.1 metres per second, at
// distances of two to four metres.
CameraPath Swaying(std::uint64_t seed) {
  Random random(seed);
  std::vector<double> phases;
  for (int i = 0; i < 6; ++i) phases.push_back(random.Uniform(0, 6.28));
  return [phases](double t) {
    const auto sway = [&](std::size_t i, double hertz) { return std::sin(6.28 * hertz * t + phases[i]); };
    const Eigen::Vector3d angles(0.03 * sway(0, 1.1), 0.06 * sway(1, 0.9), 0.02 * sway(2, 1.3)),
        centre(0.1 * t + 0.01 * sway(3, 1), 0.01 * sway(4, 1.2), 0.02 * sway(5, 0.8));
    const Rotation3 rotation = Rotation3::Exp(angles);
    return Rigid3(rotation, -(rotation * centre));
  };
}

struct RolledScene {
  CameraPath motion = Swaying(1);
  Eigen::Vector2d readout_s = {0, 0.02};
  int images = 20, corners = 150;
  double noise_px = 0.05;
  int wrong = 0;  // corners that drift by a pixel per image
  std::uint64_t seed = 1;
  CameraModel camera = *Camera();  // the true one
};

// The pixel where a rolling shutter exposes a point.
std::optional<Eigen::Vector2d> ExposedPixel(const RolledScene& scene, const Eigen::Vector3d& point,
                                            double time) {
  auto pixel = scene.camera.Project(scene.motion(time) * point);
  for (int i = 0; i < 5 && pixel; ++i) {
    const double delay = scene.readout_s.dot(scene.camera.ReadoutPosition(*pixel));
    pixel = scene.camera.Project(scene.motion(time + delay) * point);
  }
  return pixel && scene.camera.IsInside(*pixel) ? pixel : std::nullopt;
}

CornerSequence ShowCorners(const RolledScene& scene) {
  constexpr double kInterval_s = 1 / 30.0;
  CornerSequence sequence;
  for (int i = 0; i < scene.images; ++i) {
    const Rigid3 now = scene.motion(i * kInterval_s), before = scene.motion((i - 1) * kInterval_s);
    sequence.images.push_back({FromSeconds(i * kInterval_s), now.rotation * before.rotation.inverse()});
  }
  Random random(scene.seed);
  const auto noise = [&] { return scene.noise_px * 1.7 * random.Uniform(-1, 1); };  // of this deviation
  while (static_cast<int>(sequence.corners.size()) < scene.corners) {
    const double depth = random.Uniform(2, 4);
    const Eigen::Vector3d point(random.Uniform(-0.8, 0.8) * depth, random.Uniform(-0.6, 0.6) * depth, depth);
    const bool wrong = static_cast<int>(sequence.corners.size()) < scene.wrong;
    CornerSequence::Corner corner;
    for (int i = 0; i < scene.images; ++i) {
      const auto pixel = ExposedPixel(scene, point, i * kInterval_s);
      if (!pixel) break;
      corner.pixels.push_back(
          Eigen::Vector2d(pixel->x() + noise() + (wrong ? i : 0), pixel->y() + noise()).cast<float>());
    }
    if (corner.pixels.size() == sequence.images.size()) sequence.corners.push_back(corner);
  }
  return sequence;
}

double InMilliseconds(double seconds) {
  return 1000 * seconds;
}

std::optional<TrackReadout> EstimateScene(const RolledScene& scene) {
  return EstimateTrackReadout({}, *Camera(), ShowCorners(scene));
}

TEST(TrackReadout, IsThatOfTheShutterWhileAHandSways) {
  for (const Eigen::Vector2d& readout_s :
       {Eigen::Vector2d(0, 0.02), {0, -0.03}, {0.015, 0}, {-0.025, 0}, {0, 0}}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      RolledScene scene;
      scene.motion = Swaying(seed);
      scene.seed = seed;
      scene.readout_s = readout_s;
      const auto estimate = EstimateScene(scene);
      ASSERT_TRUE(estimate);
      EXPECT_LT(InMilliseconds((estimate->readout_s - readout_s).norm()), 3)
          << estimate->readout_s.transpose() << " instead of " << readout_s.transpose();
      EXPECT_LT(InMilliseconds(estimate->sigma_s), 3);
      EXPECT_LT(estimate->noise_px, 0.1);
    }
  }
}

TEST(TrackReadout, ReturnsTheRotationRateOfEachImage) {
  const RolledScene scene;
  const auto estimate = EstimateScene(scene);
  ASSERT_TRUE(estimate);
  ASSERT_EQ(estimate->rotation_rates.size(), 20u);
  ASSERT_EQ(estimate->times.size(), 20u);
  for (std::size_t i = 1; i + 1 < estimate->times.size(); ++i) {
    constexpr double kStep_s = 1e-3;
    const double t = ToSeconds(estimate->times[i]);
    Eigen::Matrix<double, 6, 1> twist =
        (scene.motion(t + kStep_s) * scene.motion(t - kStep_s).inverse()).Log() / (2 * kStep_s);
    // The translation displaces points at the median depth like a rotation.
    const Eigen::Vector3d truth = twist.tail<3>() + Eigen::Vector3d(-twist[1], twist[0], 0) / 3;
    EXPECT_LT((estimate->rotation_rates[i] - truth).norm(), 0.04) << "image " << i;
  }
}

TEST(TrackReadout, IsHardlyChangedByAnImperfectCalibration) {
  auto intrinsics = Camera()->intrinsics();
  intrinsics.fx *= 1.01;
  intrinsics.fy *= 1.01;
  auto distortion = Camera()->distortion();
  distortion[0] += 0.003;  // half a pixel in the corners
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RolledScene scene;
    scene.motion = Swaying(seed);
    scene.seed = seed;
    scene.camera = CameraModel(Camera()->lens(), intrinsics, distortion);
    const auto estimate = EstimateScene(scene);
    ASSERT_TRUE(estimate);
    EXPECT_LT(InMilliseconds((estimate->readout_s - scene.readout_s).norm()), 5);
  }
}

TEST(TrackReadout, IsUncertainWhileTheMotionIsUniform) {
  RolledScene scene;
  scene.motion = [](double t) {
    const Rotation3 rotation = Rotation3::Exp({0, 0.1 * t, 0});
    return Rigid3(rotation, -(rotation * Eigen::Vector3d(0.1 * t, 0, 0)));
  };
  const auto uniform = EstimateScene(scene);
  scene.motion = Swaying(1);
  const auto swaying = EstimateScene(scene);
  ASSERT_TRUE(uniform);
  ASSERT_TRUE(swaying);
  EXPECT_GT(uniform->sigma_s, 4 * swaying->sigma_s);
}

TEST(TrackReadout, IsNotImpressedByWrongCorners) {
  RolledScene scene;
  scene.wrong = scene.corners / 10;
  const auto estimate = EstimateScene(scene);
  ASSERT_TRUE(estimate);
  EXPECT_LT(InMilliseconds((estimate->readout_s - scene.readout_s).norm()), 3);
}

TEST(TrackReadout, IsMissingWhereTheImagesDoNotTellIt) {
  RolledScene scene;
  scene.images = TrackReadoutOptions().min_images - 1;
  EXPECT_FALSE(EstimateScene(scene)) << "too few images";
  scene = {};
  scene.corners = TrackReadoutOptions().min_corners - 1;
  EXPECT_FALSE(EstimateScene(scene)) << "too few corners";
  scene = {};
  scene.noise_px = 2 * TrackReadoutOptions().max_noise_px;
  EXPECT_FALSE(EstimateScene(scene)) << "no rigid scene fits";
  EXPECT_FALSE(EstimateTrackReadout({}, *Camera(), {}));
}

TEST(TrackReadout, IsAtMostTheTimeBetweenTwoImages) {
  RolledScene scene;
  scene.readout_s = {0, 0.038};  // more than is possible, as errors of the corners may suggest
  const auto estimate = EstimateScene(scene);
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->readout_s.y(), 1 / 30.0, 1e-6);
}

}  // namespace
}  // namespace docent::engine
