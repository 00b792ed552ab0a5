// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/track_readout.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "tests/engine/initialization/rolled_scene.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::RolledScene;
using testing_world::ShowCorners;
using testing_world::Swaying;

double InMilliseconds(double seconds) {
  return 1000 * seconds;
}

std::optional<TrackReadout> EstimateScene(const RolledScene& scene) {
  return EstimateTrackReadout({}, *Camera(), ShowCorners(scene));
}

// A camera with these sides in pixels and the focal length of Camera().
CameraModel CameraWithSides(int width_px, int height_px) {
  CameraModel::Intrinsics intrinsics = Camera()->intrinsics();
  intrinsics.width_px = width_px;
  intrinsics.height_px = height_px;
  intrinsics.cx = width_px / 2.0 - 0.5;
  intrinsics.cy = height_px / 2.0 - 0.5;
  return CameraModel(Camera()->lens(), intrinsics, Camera()->distortion());
}

TEST(TrackReadout, IsThatOfTheShutterWhileAHandSways) {
  for (const Eigen::Vector2d& readout_s :
       {Eigen::Vector2d(0, 0.02), {0, -0.03}, {0.015, 0}, {-0.025, 0}, {0, 0}}) {
    const bool upright = readout_s.x() != 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      RolledScene scene;
      scene.motion = Swaying(seed);
      scene.seed = seed;
      scene.readout_s = readout_s;
      scene.camera = upright ? CameraWithSides(240, 320) : *Camera();
      const auto estimate = EstimateTrackReadout({}, scene.camera, ShowCorners(scene));
      ASSERT_TRUE(estimate);
      EXPECT_LT(InMilliseconds((estimate->readout_s - readout_s).norm()), 3)
          << estimate->readout_s.transpose() << " instead of " << readout_s.transpose();
      EXPECT_LT(InMilliseconds(estimate->sigma_s), 3);
      EXPECT_LT(estimate->noise_px, 0.1);
    }
  }
}

TEST(TrackReadout, TriesRowsAndColumnsInASquareImage) {
  for (const Eigen::Vector2d& readout_s : {Eigen::Vector2d(0, 0.02), {-0.02, 0}}) {
    RolledScene scene;
    scene.camera = CameraWithSides(280, 280);
    scene.readout_s = readout_s;
    const auto estimate = EstimateTrackReadout({}, scene.camera, ShowCorners(scene));
    ASSERT_TRUE(estimate);
    EXPECT_LT(InMilliseconds((estimate->readout_s - readout_s).norm()), 3)
        << estimate->readout_s.transpose() << " instead of " << readout_s.transpose();
  }
}

TEST(TrackReadout, FindsNoColumnsInAnImageThatIsWiderThanHigh) {
  RolledScene scene;
  scene.readout_s = {0.03, 0};  // which no camera has
  const auto estimate = EstimateScene(scene);
  EXPECT_TRUE(!estimate || estimate->readout_s.x() == 0);
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

TEST(TrackReadout, IsRobustToWrongCorners) {
  for (const double drift_px : {0.05, 0.2, 1.0}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      RolledScene scene;
      scene.motion = Swaying(seed);
      scene.wrong = scene.corners / 8;
      scene.drift_px = drift_px;
      const auto estimate = EstimateScene(scene);
      ASSERT_TRUE(estimate);
      EXPECT_LT(InMilliseconds((estimate->readout_s - scene.readout_s).norm()), 3)
          << drift_px << " pixels per image";
    }
  }
}

TEST(TrackReadout, IsPassedOnOnlyIfItIsSignificant) {
  TrackReadout estimate;
  estimate.readout_s = {0, 0.02};
  estimate.sigma_s = 0.002;
  const auto prior = SignificantReadout({}, estimate);
  ASSERT_TRUE(prior);
  EXPECT_EQ(prior->readout_s, estimate.readout_s);
  EXPECT_EQ(prior->sigma_s, estimate.sigma_s);
  estimate.sigma_s = 0.008;
  EXPECT_FALSE(SignificantReadout({}, estimate)) << "it may be zero";
  estimate.readout_s = {0.005, 0};
  estimate.sigma_s = 0.001;
  EXPECT_FALSE(SignificantReadout({}, estimate)) << "the errors of a calibration look alike";
}

TEST(TrackReadout, IsNotEstimatedWhereTheImagesDoNotDetermineIt) {
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
