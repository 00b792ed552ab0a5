// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "engine/base/random.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {
namespace {

const std::shared_ptr<const CameraModel> kCamera = std::make_shared<CameraModel>(
    LensModel::kRadialTangential, CameraModel::Intrinsics{640, 480, 520, 515, 322, 238},
    std::array<double, 5>{-0.2, 0.05, 0.001, -0.0005, 0});

// A fast turn of the hand, and a phone whose rows take 30 ms and whose columns take none.
ReadoutMotion FastTurn() {
  return {.rotation_rate = {0.7, -1.5, 0.4}, .readout_s = {0, 0.03}};
}

Eigen::Vector3d RandomPoint(Random* random) {
  const double depth = random->Uniform(1, 5);
  return {random->Uniform(-0.45, 0.45) * depth, random->Uniform(-0.35, 0.35) * depth, depth};
}

// The row at which a point is seen, and where, found by trying all of its exposure times.
Eigen::Vector2d ProjectRowByRow(const ReadoutMotion& motion, const Eigen::Vector3d& point) {
  double early = -0.5, late = 0.5;  // the scan overtakes the point exactly once
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (early + late);
    const Rotation3 rotation = Rotation3::Exp(motion.rotation_rate * motion.readout_s.y() * middle);
    const Eigen::Vector2d pixel = *kCamera->Project(rotation * point);
    (kCamera->ReadoutPosition(pixel).y() > middle ? early : late) = middle;
  }
  return *kCamera->Project(
      Rotation3::Exp(motion.rotation_rate * motion.readout_s.y() * 0.5 * (early + late)) * point);
}

TEST(RollingShutterCamera, ProjectsAPointWhereTheRowThatSeesItWasExposed) {
  const CameraModel image = CameraModel::WithReadout(kCamera, FastTurn());
  Random random(1);
  double largest = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d point = RandomPoint(&random);
    const Eigen::Vector2d expected = ProjectRowByRow(FastTurn(), point);
    EXPECT_LT((*image.Project(point) - expected).norm(), 0.05) << point.transpose();
    largest = std::max(largest, (expected - *kCamera->Project(point)).norm());
  }
  EXPECT_GT(largest, 8) << "a turn this fast displaces the first and the last row by many pixels";
}

TEST(RollingShutterCamera, UnprojectsAPixelToTheRayThatProjectsToIt) {
  const CameraModel image = CameraModel::WithReadout(kCamera, FastTurn());
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d point = RandomPoint(&random);
    const auto ray = image.Unproject(*image.Project(point));
    ASSERT_TRUE(ray);
    // A twentieth of a pixel.
    EXPECT_LT((*ray - point.normalized()).norm(), 0.05 * kCamera->PixelAngle());
  }
}

TEST(RollingShutterCamera, JacobianEqualsTheNumericDerivative) {
  const CameraModel image = CameraModel::WithReadout(kCamera, FastTurn());
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d point = RandomPoint(&random);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> jacobian;
    ASSERT_TRUE(image.Project(point, &pixel, &jacobian));
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = 1e-5 * point.norm() * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector2d numeric =
          (*image.Project(point + step) - *image.Project(point - step)) / (2 * step.norm());
      EXPECT_LT((jacobian.col(axis) - numeric).norm(), 2e-3 * jacobian.norm()) << point.transpose();
    }
  }
}

TEST(RollingShutterCamera, EqualsTheCameraToTheBitWithoutRotationOrReadout) {
  Random random(4);
  for (const ReadoutMotion& motion :
       {ReadoutMotion{}, ReadoutMotion{{0, 0, 0}, {0, 0.03}}, ReadoutMotion{{0.7, -1.5, 0.4}, {0, 0}}}) {
    const CameraModel image = CameraModel::WithReadout(kCamera, motion);
    EXPECT_TRUE(image == *kCamera);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d point = RandomPoint(&random);
      EXPECT_EQ(*image.Project(point), *kCamera->Project(point));
    }
  }
  EXPECT_FALSE(CameraModel::WithReadout(kCamera, FastTurn()) == *kCamera);
  EXPECT_TRUE(CameraModel::WithReadout(kCamera, FastTurn()).HasSameLens(*kCamera));
}

TEST(RollingShutterCamera, PassesAKnownReadoutTimeToItsImages) {
  const auto lens = std::make_shared<const CameraModel>();
  EXPECT_FALSE(lens->known_readout_s());
  const auto known = std::make_shared<const CameraModel>(lens->WithKnownReadout({0, 0.02}));
  EXPECT_EQ(known->known_readout_s(), Eigen::Vector2d(0, 0.02));
  EXPECT_EQ(CameraModel::WithReadout(known, {{0, 1, 0}, {0, 0.02}}).known_readout_s(),
            Eigen::Vector2d(0, 0.02));
  EXPECT_EQ(*known, *lens) << "the camera itself does not turn";
}

TEST(RollingShutterCamera, KnowsItsCameraHoweverOftenTheMotionIsReplaced) {
  const auto image = std::make_shared<CameraModel>(CameraModel::WithReadout(kCamera, FastTurn()));
  const CameraModel again = CameraModel::WithReadout(image, {{1, 0, 0}, {0, 0.02}});
  EXPECT_EQ(again.lens_of_image(), kCamera);
  EXPECT_EQ(kCamera->lens_of_image(), nullptr);
  EXPECT_EQ(CameraModel::WithMotionOf(*kCamera, image), image) << "no motion to take over";
  const auto moved = CameraModel::WithMotionOf(again, kCamera);
  EXPECT_TRUE(*moved == again);
}

TEST(RollingShutterCamera, ScansColumnsOfACameraThatIsHeldUpright) {
  // Exposed from the last column to the first while the camera turns about the vertical axis: the image is
  // narrower or wider, and nothing moves up or down.
  const CameraModel image = CameraModel::WithReadout(kCamera, {{0, 1, 0}, {-0.03, 0}});
  const Eigen::Vector3d left(-0.5, 0, 1), right(0.5, 0, 1);
  const double width = (*image.Project(right) - *image.Project(left)).x();
  const double at_once = (*kCamera->Project(right) - *kCamera->Project(left)).x();
  EXPECT_GT(std::abs(width - at_once), 5);
  EXPECT_LT(std::abs((*image.Project(right) - *kCamera->Project(right)).y()), 0.5);
}

}  // namespace
}  // namespace docent::engine
