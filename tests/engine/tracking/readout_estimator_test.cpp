// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/readout_estimator.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

constexpr double kFrame_s = 1.0 / 30;
constexpr double kNoise_px = 0.5;

std::shared_ptr<const CameraModel> CameraOf(int width_px, int height_px) {
  return std::make_shared<CameraModel>(
      LensModel::kRadialTangential,
      CameraModel::Intrinsics{width_px, height_px, 520, 520, width_px / 2.0 - 0.5, height_px / 2.0 - 0.5},
      std::array<double, 5>{});
}
const std::shared_ptr<const CameraModel> kCamera = CameraOf(640, 480);
const std::shared_ptr<const CameraModel> kUprightCamera = CameraOf(480, 640);

double Normal(Random* random) {
  return std::sqrt(-2 * std::log(1 - random->Uniform())) * std::cos(2 * std::numbers::pi * random->Uniform());
}

// A hand that turns to and fro about all axes.
Eigen::Vector3d RateAt(int frame) {
  return {0.8 * std::sin(0.21 * frame), 1.2 * std::sin(0.13 * frame + 1), 0.5 * std::sin(0.3 * frame + 2)};
}

// Shows `estimator` frames of a camera that really has `readout_s`: random points, their pixels with noise,
// and the pose that fits them best with the model that the estimator has so far.
void ShowFrames(const Eigen::Vector2d& readout_s, int frames, double outliers, std::uint64_t seed,
                ReadoutEstimator* estimator, const std::shared_ptr<const CameraModel>& camera = kCamera) {
  Random random(seed);
  PoseRefinementMemory memory;
  for (int frame = 0; frame < frames; ++frame) {
    const ReadoutMotion truth{RateAt(frame), readout_s};
    const CameraModel real = CameraModel::WithReadout(camera, truth);
    const CameraModel assumed =
        CameraModel::WithReadout(camera, {truth.rotation_rate, estimator->readout_s()});
    std::vector<PoseMeasurement> measurements;
    while (measurements.size() < 300) {
      const double depth = random.Uniform(2, 6);
      const Eigen::Vector3d x(random.Uniform(-0.6, 0.6) * depth, random.Uniform(-0.45, 0.45) * depth, depth);
      auto pixel = real.Project(x);
      if (!pixel || !camera->IsInside(*pixel)) continue;
      *pixel += kNoise_px * Eigen::Vector2d(Normal(&random), Normal(&random));
      if (random.Uniform(0, 1) < outliers)
        *pixel += Eigen::Vector2d(random.Uniform(-9, 9), random.Uniform(-9, 9));
      measurements.push_back({x.homogeneous(), *pixel, 1.0, 1.0, false});
    }
    const PoseRefinement pose = RefinePose(assumed, Rigid3(), {}, &measurements, &memory, {});
    ASSERT_TRUE(pose.converged);
    estimator->Add(assumed, pose.camera_from_map, measurements, pose.sigma, kFrame_s);
  }
}

TEST(ReadoutEstimator, FindsTheReadoutTimeOfTheRows) {
  for (const double readout_s : {0.012, 0.02, 0.03}) {
    ReadoutEstimator estimator({});
    ShowFrames({0, readout_s}, 60, 0.1, 1, &estimator);
    EXPECT_NEAR(estimator.readout_s().y(), readout_s, 0.0015);
    EXPECT_EQ(estimator.readout_s().x(), 0);
    EXPECT_LT(std::abs(estimator.estimate_s().y() - readout_s), 4 * estimator.sigma_s().y());
  }
}

TEST(ReadoutEstimator, FindsAReadoutOfACameraThatIsHeldUprightOrUpsideDown) {
  for (const Eigen::Vector2d& readout_s :
       {Eigen::Vector2d(0.025, 0), Eigen::Vector2d(-0.025, 0), Eigen::Vector2d(0, -0.025)}) {
    ReadoutEstimator estimator({});
    ShowFrames(readout_s, 60, 0, 2, &estimator, readout_s.x() != 0 ? kUprightCamera : kCamera);
    EXPECT_LT((estimator.readout_s() - readout_s).norm(), 0.0015) << readout_s.transpose();
  }
}

TEST(ReadoutEstimator, UsesNoneForAGlobalShutter) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    ReadoutEstimator estimator({});
    ShowFrames({0, 0}, 100, 0.1, 100 + seed, &estimator);
    EXPECT_TRUE(estimator.readout_s().isZero(0))
        << estimator.readout_s().transpose() << " with seed " << seed;
    EXPECT_LT(estimator.estimate_s().norm(), 0.001);
  }
}

TEST(ReadoutEstimator, LearnsNothingFromACameraThatHardlyTurns) {
  ReadoutEstimator estimator({.min_rate = 5});
  ShowFrames({0, 0.03}, 60, 0, 3, &estimator);
  EXPECT_TRUE(estimator.readout_s().isZero(0));
  EXPECT_DOUBLE_EQ(estimator.sigma_s().y(), ReadoutOptions().prior_sigma_s);
}

TEST(ReadoutEstimator, NeverExceedsTheTimeBetweenTwoFrames) {
  ReadoutEstimator estimator({.prior_sigma_s = 1});
  ShowFrames({0, 0.05}, 60, 0, 4, &estimator);
  EXPECT_LE(estimator.readout_s().y(), kFrame_s);
}

TEST(ReadoutEstimator, DoesNotWorkWhereItIsDisabled) {
  ReadoutEstimator estimator({.enabled = false});
  ShowFrames({0, 0.03}, 60, 0, 5, &estimator);
  EXPECT_TRUE(estimator.readout_s().isZero(0));
}

TEST(ReadoutEstimator, RefusesOptionsThatMakeNoSense) {
  EXPECT_TRUE((ReadoutOptions{.prior_sigma_s = 0}).Validate());
  EXPECT_TRUE((ReadoutOptions{.correlated_frames = 0}).Validate());
  EXPECT_TRUE((ReadoutOptions{.max_points = 10}).Validate());
  EXPECT_FALSE(ReadoutOptions().Validate());
}

}  // namespace
}  // namespace docent::engine
