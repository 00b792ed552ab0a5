// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/rotation_center.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/random.h"
#include "tests/engine/geometry/test_math.h"

namespace docent::engine {
namespace {

constexpr double kMedianDepth = 2.5;  // metres
const Matrix6 kSmallCovariance = 1e-8 * Matrix6::Identity();

Rotation3 Yaw(double degrees) {
  return Rotation3::Exp({0, Radians(degrees), 0});
}

// The pose of a camera that rotates about a fixed point: `pivot` in the camera frame, (1, 2, 3) in the map.
Rigid3 RotatedAboutPivot(const Eigen::Vector3d& pivot, double degrees) {
  const Rotation3 rotation = Yaw(degrees);
  return Rigid3(rotation, pivot - rotation * Eigen::Vector3d(1, 2, 3));
}

// The estimator after one second in which the camera rotates by 30 degrees; every pose has errors of up to
// noise_m and noise_deg per axis.
RotationCenter AfterRotation(const Eigen::Vector3d& pivot, double noise_m, double noise_deg) {
  RotationCenter rotation_center({});
  Random random(7);
  for (int i = 0; i <= 30; ++i) {
    const Rotation3 turn = Rotation3::Exp(RandomVector(&random, Radians(noise_deg)));
    const Rigid3 noise(turn, RandomVector(&random, noise_m));
    rotation_center.Add(FromSeconds(i / 30.0), noise * RotatedAboutPivot(pivot, i), kSmallCovariance,
                        kMedianDepth);
  }
  return rotation_center;
}

TEST(RotationCenter, IsTheShoulderOfACameraHeldAtArmsLength) {
  const Eigen::Vector3d shoulder(0.15, 0, -0.6);
  const Eigen::Vector3d found = AfterRotation(shoulder, 0.002, 0.05).Estimate(kMedianDepth).pivot;
  // Along the rotation axis the centre is unobservable, and stays at the camera.
  EXPECT_NEAR(found.x(), shoulder.x(), 0.03);
  EXPECT_NEAR(found.y(), 0, 0.03);
  EXPECT_NEAR(found.z(), shoulder.z(), 0.03);
}

TEST(RotationCenter, IsTheCameraCentreForAStaticPosition) {
  EXPECT_EQ(AfterRotation(Eigen::Vector3d::Zero(), 0, 0).Estimate(kMedianDepth).pivot,
            Eigen::Vector3d::Zero());
  EXPECT_LT(AfterRotation(Eigen::Vector3d::Zero(), 0.002, 0.05).Estimate(kMedianDepth).pivot.norm(), 0.02);
}

TEST(RotationCenter, IsCertainOnlyForAPreciseRotation) {
  const Eigen::Vector3d shoulder(0.15, 0, -0.6);
  EXPECT_TRUE(AfterRotation(shoulder, 0.002, 0.05).Estimate(kMedianDepth).reliable);
  EXPECT_TRUE(AfterRotation(Eigen::Vector3d::Zero(), 0.002, 0.05).Estimate(kMedianDepth).reliable)
      << "a rotation about the camera centre";
  EXPECT_FALSE(AfterRotation(shoulder, 0.05, 0.05).Estimate(kMedianDepth).reliable) << "a moving shoulder";
  EXPECT_FALSE(RotationCenter({}).Estimate(kMedianDepth).reliable);
}

TEST(RotationCenter, IsTheCameraCentreForTranslationOrSmallRotation) {
  RotationCenter walk({}), glance({}), straight({});
  for (int i = 0; i <= 30; ++i) {
    const Timestamp time = FromSeconds(i / 30.0);
    // An oscillation that is unrelated to the rotation.
    const Rotation3 rotation = Yaw(i);
    const Eigen::Vector3d center(0.1 * std::sin(0.9 * i), 0, 0.1 * std::cos(1.7 * i));
    walk.Add(time, Rigid3(rotation, -(rotation * center)), kSmallCovariance, kMedianDepth);
    glance.Add(time, RotatedAboutPivot({0, 0, -0.6}, 0.1 * i), kSmallCovariance, kMedianDepth);
    straight.Add(time, Rigid3({}, {-0.05 * i, 0, 0}), kSmallCovariance, kMedianDepth);
  }
  EXPECT_EQ(walk.Estimate(kMedianDepth).pivot, Eigen::Vector3d::Zero());
  EXPECT_EQ(glance.Estimate(kMedianDepth).pivot, Eigen::Vector3d::Zero());
  EXPECT_EQ(straight.Estimate(kMedianDepth).pivot, Eigen::Vector3d::Zero());
}

TEST(RotationCenter, UsesRecentAndPrecisePosesOnly) {
  RotationCenter rotation_center({});
  const Eigen::Vector3d shoulder(0, 0, -0.5);
  for (int i = 0; i <= 30; ++i)  // an older rotation about another point
    rotation_center.Add(FromSeconds(i / 30.0), RotatedAboutPivot({0.8, 0, 0.3}, i), kSmallCovariance,
                        kMedianDepth);
  for (int i = 0; i <= 30; ++i) {
    rotation_center.Add(FromSeconds(10 + i / 30.0), RotatedAboutPivot(shoulder, i), kSmallCovariance,
                        kMedianDepth);
    rotation_center.Add(FromSeconds(10.001 + i / 30.0), RotatedAboutPivot({3, 3, 3}, 3 * i),
                        Matrix6::Identity(), kMedianDepth);
  }
  EXPECT_LT((rotation_center.Estimate(kMedianDepth).pivot - shoulder).norm(), 0.02);
  rotation_center.Reset();
  EXPECT_EQ(rotation_center.Estimate(kMedianDepth).pivot, Eigen::Vector3d::Zero());
}

TEST(RotationCenter, RotatedAboutKeepsThePivotFixed) {
  const Eigen::Vector3d pivot(0.1, -0.2, -0.6);
  const Rigid3 before = RotatedAboutPivot(pivot, 12);
  const Rigid3 after = RotatedAbout(pivot, before, Yaw(47));
  EXPECT_LT((after.inverse() * pivot - before.inverse() * pivot).norm(), 1e-12);
  EXPECT_LT((after.rotation * Yaw(47).inverse()).Angle(), 1e-12);
  EXPECT_LT((after * RotatedAboutPivot(pivot, 47).inverse()).Log().norm(), 1e-12);
}

}  // namespace
}  // namespace docent::engine
