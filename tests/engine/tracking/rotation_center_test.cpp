// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/rotation_center.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kDepth = 2.5;  // metres
const Matrix6 kSure = 1e-8 * Matrix6::Identity();

Rotation3 Yaw(double degrees) {
  return Rotation3::Exp({0, degrees * std::numbers::pi / 180, 0});
}

// A camera that turns about a point that stands still at `pivot` of its frame, and at (1, 2, 3) of the map.
Rigid3 Turned(const Eigen::Vector3d& pivot, double degrees) {
  const Rotation3 rotation = Yaw(degrees);
  return Rigid3(rotation, pivot - rotation * Eigen::Vector3d(1, 2, 3));
}

// A second of a turn of 30 degrees; every pose is off by up to noise_m and noise_deg.
RotationCenter After(const Eigen::Vector3d& pivot, double noise_m, double noise_deg) {
  RotationCenter rotation_center({});
  Random random(7);
  for (int i = 0; i <= 30; ++i) {
    const auto any = [&](double size) {
      return Eigen::Vector3d(random.Uniform(-size, size), random.Uniform(-size, size),
                             random.Uniform(-size, size));
    };
    const Rigid3 noise(Rotation3::Exp(any(noise_deg * std::numbers::pi / 180)), any(noise_m));
    rotation_center.Add(FromSeconds(i / 30.0), noise * Turned(pivot, i), kSure, kDepth);
  }
  return rotation_center;
}

TEST(RotationCenter, IsTheShoulderOfTheArmThatHoldsTheCamera) {
  const Eigen::Vector3d shoulder(0.15, 0, -0.6);
  const Eigen::Vector3d found = After(shoulder, 0.002, 0.05).Estimate(kDepth).pivot;
  // Along the axis of the turn nothing is told; there it stays by the camera.
  EXPECT_NEAR(found.x(), shoulder.x(), 0.03);
  EXPECT_NEAR(found.y(), 0, 0.03);
  EXPECT_NEAR(found.z(), shoulder.z(), 0.03);
}

TEST(RotationCenter, IsTheCameraWhereTheCameraStays) {
  EXPECT_EQ(After(Eigen::Vector3d::Zero(), 0, 0).Estimate(kDepth).pivot, Eigen::Vector3d::Zero());
  EXPECT_LT(After(Eigen::Vector3d::Zero(), 0.002, 0.05).Estimate(kDepth).pivot.norm(), 0.02);
}

TEST(RotationCenter, IsSureOfATurnThatHardlyErrsAndOfNothingElse) {
  const Eigen::Vector3d shoulder(0.15, 0, -0.6);
  EXPECT_TRUE(After(shoulder, 0.002, 0.05).Estimate(kDepth).sure);
  EXPECT_TRUE(After(Eigen::Vector3d::Zero(), 0.002, 0.05).Estimate(kDepth).sure) << "about itself";
  EXPECT_FALSE(After(shoulder, 0.05, 0.05).Estimate(kDepth).sure) << "the shoulder sways";
  EXPECT_FALSE(RotationCenter({}).Estimate(kDepth).sure);
}

TEST(RotationCenter, IsTheCameraWhereItWalksOrHardlyTurns) {
  RotationCenter walk({}), glance({}), straight({});
  for (int i = 0; i <= 30; ++i) {
    const Timestamp time = FromSeconds(i / 30.0);
    // To and fro, with no relation to the turn.
    const Rotation3 rotation = Yaw(i);
    const Eigen::Vector3d center(0.1 * std::sin(0.9 * i), 0, 0.1 * std::cos(1.7 * i));
    walk.Add(time, Rigid3(rotation, -(rotation * center)), kSure, kDepth);
    glance.Add(time, Turned({0, 0, -0.6}, 0.1 * i), kSure, kDepth);
    straight.Add(time, Rigid3({}, {-0.05 * i, 0, 0}), kSure, kDepth);
  }
  EXPECT_EQ(walk.Estimate(kDepth).pivot, Eigen::Vector3d::Zero());
  EXPECT_EQ(glance.Estimate(kDepth).pivot, Eigen::Vector3d::Zero());
  EXPECT_EQ(straight.Estimate(kDepth).pivot, Eigen::Vector3d::Zero());
}

TEST(RotationCenter, LooksAtTheLastMomentsAndAtSurePosesOnly) {
  RotationCenter rotation_center({});
  const Eigen::Vector3d shoulder(0, 0, -0.5);
  for (int i = 0; i <= 30; ++i)  // long ago, about another point
    rotation_center.Add(FromSeconds(i / 30.0), Turned({0.8, 0, 0.3}, i), kSure, kDepth);
  for (int i = 0; i <= 30; ++i) {
    rotation_center.Add(FromSeconds(10 + i / 30.0), Turned(shoulder, i), kSure, kDepth);
    rotation_center.Add(FromSeconds(10.001 + i / 30.0), Turned({3, 3, 3}, 3 * i), Matrix6::Identity(),
                        kDepth);
  }
  EXPECT_LT((rotation_center.Estimate(kDepth).pivot - shoulder).norm(), 0.02);
  rotation_center.Reset();
  EXPECT_EQ(rotation_center.Estimate(kDepth).pivot, Eigen::Vector3d::Zero());
}

TEST(RotationCenter, StaysWhereItIsWhenTheCameraTurnsAboutIt) {
  const Eigen::Vector3d pivot(0.1, -0.2, -0.6);
  const Rigid3 before = Turned(pivot, 12);
  const Rigid3 after = RotatedAbout(pivot, before, Yaw(47));
  EXPECT_LT((after.inverse() * pivot - before.inverse() * pivot).norm(), 1e-12);
  EXPECT_LT((after.rotation * Yaw(47).inverse()).Angle(), 1e-12);
  EXPECT_LT((after * Turned(pivot, 47).inverse()).Log().norm(), 1e-12);
}

}  // namespace
}  // namespace docent::engine
