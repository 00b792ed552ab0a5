// SPDX-License-Identifier: Apache-2.0
#include "engine/system/camera_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "app/output/engine_text.h"
#include "engine/base/random.h"
#include "tests/app/support/rad_per_degree.h"

namespace docent::app {
namespace {

using engine::Rigid3;
using engine::Rotation3;

double Normal(Random* random) {
  return std::sqrt(-2 * std::log(1 - random->Uniform())) * std::cos(2 * std::numbers::pi * random->Uniform());
}

Eigen::Vector3d NormalVector(Random* random, double sigma) {
  return sigma * Eigen::Vector3d(Normal(random), Normal(random), Normal(random));
}

// The pose of the first camera, on a head that looks around while walking.
Rigid3 FirstFromMap(double seconds) {
  const Rotation3 look =
      Rotation3::Exp({0.1 * std::sin(1.3 * seconds), 0.5 * std::sin(0.9 * seconds), 0.05 * seconds});
  const Eigen::Vector3d place(0.4 * std::sin(seconds), 0.1 * std::cos(2 * seconds), 0.2 * seconds);
  return Rigid3(look, place).inverse();
}

const Rigid3 kTruth(Rotation3::Exp({0.05, 0.3, -0.1}), {0.2, 0.13, -0.05});
const double kBaseline = kTruth.translation.norm();

struct Errors {
  double baseline = 0, turn_deg = 0;  // baseline: relative error
};
Errors Compare(const engine::RigEstimate& estimate) {
  return {std::abs(estimate.Baseline() / kBaseline - 1),
          (estimate.second_from_first.rotation.inverse() * kTruth.rotation).Angle() / kRadPerDegree};
}

struct Intervals {
  int first_ms = 33, second_ms = 40;
};

// Two cameras, at 30 and 25 frames per second where nothing else is given. Each pose has the noise of a
// tracker, one in ten is an outlier. arm: motion of the second camera relative to the rig, by time.
engine::CameraRig Watch(double seconds, const std::function<Rigid3(double)>& arm, std::uint64_t map_key = 1,
                        const Intervals& intervals = {}) {
  engine::CameraRig rig;
  Random random(5);
  const auto noisy = [&](const Rigid3& pose) {
    const bool outlier = random.Below(10) == 0;
    return Rigid3(Rotation3::Exp(NormalVector(&random, outlier ? 0.2 : 0.1 * kRadPerDegree)) * pose.rotation,
                  pose.translation + NormalVector(&random, outlier ? 0.2 : 0.002));
  };
  for (int tick = 0; tick * 1e-3 < seconds; ++tick) {
    const double time = tick * 1e-3;
    if (tick % intervals.first_ms == 0) rig.Add(0, FromSeconds(time), map_key, noisy(FirstFromMap(time)));
    if (tick % intervals.second_ms == 7)
      rig.Add(1, FromSeconds(time), map_key, noisy(arm(time) * kTruth * FirstFromMap(time)));
  }
  return rig;
}

TEST(RelativePose, IsCorrectWithTenPercentOutliers) {
  Random random(3);
  std::vector<Rigid3> samples;
  for (int i = 0; i < 300; ++i) {
    const bool outlier = i % 10 == 0;
    samples.emplace_back(
        Rotation3::Exp(NormalVector(&random, outlier ? 1 : 0.2 * kRadPerDegree)) * kTruth.rotation,
        kTruth.translation + NormalVector(&random, outlier ? 1 : 0.004));
  }
  const engine::RigEstimate estimate = engine::RobustRelativePose(samples);
  EXPECT_LT(Compare(estimate).baseline, 0.01);
  EXPECT_LT(Compare(estimate).turn_deg, 0.05);
  // The sigma is that of the inliers.
  EXPECT_NEAR(estimate.position_sigma, 0.004, 0.001);
  EXPECT_NEAR(estimate.rotation_sigma_deg, 0.2, 0.05);
}

TEST(Rig, IsRecognizedAsRigidFromUnsynchronizedCameras) {
  const engine::CameraRig rig = Watch(8, [](double) { return Rigid3(); });
  ASSERT_TRUE(rig.estimate());
  EXPECT_TRUE(rig.estimate()->rigid) << TextOf(*rig.estimate());
  EXPECT_LT(Compare(*rig.estimate()).baseline, 0.01);
  EXPECT_LT(Compare(*rig.estimate()).turn_deg, 0.3);
}

TEST(Rig, IsRecognizedAtEightImagesASecond) {
  const engine::CameraRig rig = Watch(8, [](double) { return Rigid3(); }, 1, {125, 125});
  ASSERT_TRUE(rig.estimate());
  EXPECT_TRUE(rig.estimate()->rigid) << TextOf(*rig.estimate());
  EXPECT_TRUE(rig.Predict(1, FromSeconds(8), 1));
}

TEST(Rig, IsNotRigidWhenTheCamerasMoveRelativeToEachOther) {
  const engine::CameraRig rig = Watch(8, [](double time) {
    return Rigid3(Rotation3::Exp({0, 0.3 * std::sin(time), 0}), {0.1 * std::sin(1.7 * time), 0, 0});
  });
  ASSERT_TRUE(rig.estimate());
  EXPECT_FALSE(rig.estimate()->rigid) << TextOf(*rig.estimate());
  EXPECT_FALSE(rig.Predict(1, FromSeconds(8), 1));
}

TEST(Rig, IsNotRigidWhenTheCamerasOnlyStoodStill) {
  engine::CameraRig rig;
  for (int i = 0; i < 300; ++i) {
    rig.Add(0, std::chrono::milliseconds(33 * i), 1, Rigid3());
    rig.Add(1, std::chrono::milliseconds(33 * i), 1, kTruth);
  }
  ASSERT_TRUE(rig.estimate());
  EXPECT_FALSE(rig.estimate()->rigid);
}

TEST(Rig, PredictsEitherCameraFromTheOther) {
  engine::CameraRig rig = Watch(8, [](double) { return Rigid3(); });
  ASSERT_TRUE(rig.estimate() && rig.estimate()->rigid);
  rig.Add(0, FromSeconds(8), 1, FirstFromMap(8));
  rig.Add(1, FromSeconds(8), 1, kTruth * FirstFromMap(8));
  const auto second = rig.Predict(1, FromSeconds(8.03), 1), first = rig.Predict(0, FromSeconds(8.03), 1);
  ASSERT_TRUE(second && first);
  EXPECT_TRUE(IsNear(*second, kTruth * FirstFromMap(8), 0.01 * kBaseline, 0.3 * kRadPerDegree));
  EXPECT_TRUE(IsNear(*first, FirstFromMap(8), 0.01 * kBaseline, 0.3 * kRadPerDegree));
  EXPECT_FALSE(rig.Predict(1, FromSeconds(9), 1)) << "the pose is a second old";
  EXPECT_FALSE(rig.Predict(1, FromSeconds(8), 2)) << "the pose is in another map";
}

TEST(Rig, IsEstimatedAgainInAMapOfAnotherScale) {
  engine::CameraRig rig = Watch(8, [](double) { return Rigid3(); });
  rig.Add(0, FromSeconds(9), 2, Rigid3());
  EXPECT_FALSE(rig.estimate());
}

}  // namespace
}  // namespace docent::app
