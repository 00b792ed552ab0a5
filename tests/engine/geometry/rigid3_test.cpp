// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/rigid3.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <vector>

#include "tests/engine/geometry/transform_laws.h"

namespace docent::engine {
namespace {

Vector6 MakeTwist(const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
  Vector6 twist;
  twist << v, w;
  return twist;
}

// The exponential by its defining power series of 4x4 matrices, with the argument halved until it is small.
Eigen::Matrix4d SeriesExponential(const Vector6& twist) {
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = Hat(twist.tail<3>());
  generator.topRightCorner<3, 1>() = twist.head<3>();
  constexpr int kHalvings = 6;
  generator /= 1 << kHalvings;
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity(), sum = term;
  for (int i = 1; i < 20; ++i) {
    term = term * generator / i;
    sum += term;
  }
  for (int i = 0; i < kHalvings; ++i) {
    sum = (sum * sum).eval();
  }
  return sum;
}

TEST(Rotation3Test, SatisfiesTheGroupLaws) {
  Random random(1);
  std::vector<Rotation3> samples = {Rotation3()};
  for (const double angle : CriticalAngles()) {
    samples.push_back(Rotation3::Exp(angle * RandomDirection(&random)));
  }
  ExpectGroupLaws(samples, 1e-14);
}

TEST(Rigid3Test, SatisfiesTheGroupLaws) {
  Random random(2);
  std::vector<Rigid3> samples = {Rigid3()};
  for (const double angle : CriticalAngles()) {
    samples.push_back({Rotation3::Exp(angle * RandomDirection(&random)), RandomVector(&random, 5)});
  }
  ExpectGroupLaws(samples, 1e-13);
}

TEST(Rotation3Test, LogInvertsExpFromZeroTo180Degrees) {
  Random random(3);
  for (const double angle : CriticalAngles()) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d direction = RandomDirection(&random);
      const Rotation3 rotation = Rotation3::Exp(angle * direction);
      EXPECT_NEAR(rotation.quaternion().norm(), 1.0, 1e-15);
      EXPECT_LT((rotation.Log() - angle * direction).norm(), 1e-15 + 1e-14 * angle) << angle;
      EXPECT_NEAR(rotation.Angle(), angle, 1e-15 + 1e-14 * angle);
    }
  }
}

TEST(Rotation3Test, LogOfMoreThan180DegreesReturnsTheSmallerAngle) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3;
  EXPECT_LT((Rotation3::Exp((kPi + 0.1) * axis).Log() + (kPi - 0.1) * axis).norm(), 1e-14);
  EXPECT_LT((Rotation3::Exp((2 * kPi - 1e-9) * axis).Log() + 1e-9 * axis).norm(), 1e-15);
  EXPECT_NEAR(Rotation3::Exp(kPi * axis).Angle(), kPi, 1e-15);
}

TEST(Rotation3Test, AngleIsTheSameForBothQuaternionsOfARotation) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.9, 0.1, -0.3, 0.2).normalized();
  const Eigen::Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((Rotation3(q).Log() - Rotation3(negated).Log()).norm(), 1e-15);
}

TEST(Rotation3Test, ManyProductsKeepUnitNorm) {
  Rotation3 rotation;
  const Rotation3 step = Rotation3::Exp({0.01, -0.02, 0.03});
  for (int i = 0; i < 100000; ++i) {
    rotation = step * rotation;
  }
  EXPECT_NEAR(rotation.quaternion().norm(), 1.0, 1e-14);
}

TEST(Rotation3Test, MatrixEqualsTheRotation) {
  const Rotation3 rotation = Rotation3::Exp({0.4, -1.2, 0.7});
  const Eigen::Vector3d x(1, 2, 3);
  EXPECT_LT((rotation.matrix() * x - rotation * x).norm(), 1e-14);
  EXPECT_LT((Rotation3(rotation.matrix()).inverse() * (rotation * x) - x).norm(), 1e-14);
}

TEST(HatTest, IsTheCrossProduct) {
  const Eigen::Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_EQ((Hat(a) * b).eval(), a.cross(b).eval());
}

TEST(Rigid3Test, ExpIsTheMatrixExponential) {
  Random random(4);
  for (const double angle : CriticalAngles()) {
    const Vector6 twist = MakeTwist(RandomVector(&random, 3), angle * RandomDirection(&random));
    const Rigid3 transform = Rigid3::Exp(twist);
    const Eigen::Matrix4d expected = SeriesExponential(twist);
    EXPECT_LT((transform.rotation.matrix() - expected.topLeftCorner<3, 3>()).norm(), 1e-12) << angle;
    EXPECT_LT((transform.translation - expected.topRightCorner<3, 1>()).norm(), 1e-12) << angle;
  }
}

TEST(Rigid3Test, LogInvertsExpFromZeroTo180Degrees) {
  Random random(5);
  for (const double angle : CriticalAngles()) {
    const Vector6 twist = MakeTwist(RandomVector(&random, 3), angle * RandomDirection(&random));
    EXPECT_LT((Rigid3::Exp(twist).Log() - twist).norm(), 1e-12) << angle;
  }
}

TEST(Rigid3Test, LeftMultipliedTwistHasTheExpectedDerivative) {
  const Rigid3 camera_from_map(Rotation3::Exp({0.3, -0.2, 0.9}), {1, 2, 3});
  const Eigen::Vector3d point(0.4, -1.1, 2.2), v(0.3, 0.5, -0.7), w(-0.2, 0.6, 0.1);
  constexpr double kStep = 1e-6;
  const Eigen::Vector3d plus = Rigid3::Exp(kStep * MakeTwist(v, w)) * camera_from_map * point;
  const Eigen::Vector3d minus = Rigid3::Exp(-kStep * MakeTwist(v, w)) * camera_from_map * point;
  const Eigen::Vector3d expected = v + w.cross(camera_from_map * point);
  EXPECT_LT(((plus - minus) / (2 * kStep) - expected).norm(), 1e-9);
}

TEST(Rigid3Test, InfiniteHomogeneousPointsAreOnlyRotated) {
  const Rigid3 transform(Rotation3::Exp({0.3, -0.2, 0.9}), {1, 2, 3});
  const Eigen::Vector3d x(0.4, -1.1, 2.2);
  Eigen::Vector4d finite, infinite;
  finite << x, 1;
  infinite << x, 0;
  EXPECT_LT(((transform * finite).head<3>() - transform * x).norm(), 1e-14);
  EXPECT_LT(((transform * infinite).head<3>() - transform.rotation * x).norm(), 1e-14);
  EXPECT_EQ((transform * finite)[3], 1);
  EXPECT_EQ((transform * infinite)[3], 0);
}

TEST(Rigid3Test, OriginInSourceIsWhatMapsToZero) {
  const Rigid3 transform(Rotation3::Exp({0.3, -0.2, 0.9}), {1, 2, 3});
  EXPECT_LT((transform * transform.OriginInSource()).norm(), 1e-14);
}

TEST(Rigid3Test, IsNearChecksTranslationAndRotationSeparately) {
  const Rigid3 a;
  const Rigid3 shifted(Rotation3(), {0.1, 0, 0}),
      turned(Rotation3::Exp({0, 0.1, 0}), Eigen::Vector3d::Zero());
  EXPECT_TRUE(IsNear(a, shifted, 0.11, 0));
  EXPECT_FALSE(IsNear(a, shifted, 0.09, 1));
  EXPECT_TRUE(IsNear(a, turned, 0, 0.11));
  EXPECT_FALSE(IsNear(a, turned, 1, 0.09));
}

TEST(Rigid3Test, PrintsTranslationAndQuaternion) {
  std::ostringstream text;
  text << Rigid3(Rotation3(), {1, 2, 3});
  EXPECT_EQ(text.str(), "translation 1 2 3, rotation (qx qy qz qw) 0 0 0 1");
}

}  // namespace
}  // namespace docent::engine
