// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/planar_target.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/vision/features.h"
#include "tests/engine/initialization/target_scene.h"
#include "tests/engine/vision/noise_image.h"

namespace docent::engine {
namespace {

using testing_world::BoardCamera;
using testing_world::LookAtBoard;
using testing_world::TargetScene;

const TargetScene& LoneBoard() {
  static const TargetScene scene(31);
  return scene;
}
const PlanarTarget& LoneTarget() {
  static const PlanarTarget target(LoneBoard().image, LoneBoard().width_m);
  return target;
}

struct BoardView {
  double distance, slant_deg, rise_deg, roll_deg;
};

std::shared_ptr<const ImageFeatures> RenderFeatures(const BoardView& view, double noise = 1.5) {
  const Rigid3 pose = LookAtBoard(view.distance, view.slant_deg, view.rise_deg, view.roll_deg);
  return MakeFeatures(LoneBoard().world.Render(*BoardCamera(), pose, noise));
}
Rigid3 TruePoseOfTarget(const BoardView& view) {
  return LookAtBoard(view.distance, view.slant_deg, view.rise_deg, view.roll_deg) *
         LoneBoard().world_from_target;
}

TEST(PlanarTarget, IsDetectedAtItsTruePoseFromAllSides) {
  for (const BoardView& view : {BoardView{1.6, 0, 0, 0},
                                {2, 30, 0, 0},
                                {2, -45, 10, 90},
                                {2, 10, -45, 180},
                                {3, 20, 20, -35},
                                {4, 0, 30, 10},
                                {1.2, 15, 5, -100},
                                {2.5, 50, -10, 20}}) {
    SCOPED_TRACE(testing::Message() << view.distance << " m, " << view.slant_deg << ", " << view.rise_deg
                                    << ", " << view.roll_deg);
    const auto detection = LoneTarget().Detect(*RenderFeatures(view), *BoardCamera(), 1);
    ASSERT_TRUE(detection);
    EXPECT_LT((detection->camera_from_target.translation - TruePoseOfTarget(view).translation).norm(),
              0.005 * view.distance);
    EXPECT_LT(RotationErrorDeg(detection->camera_from_target, TruePoseOfTarget(view)), 0.5);
    EXPECT_LT(detection->rms_px, 0.6);
  }
}

TEST(PlanarTarget, ReturnsPointsAtTheirTruePixels) {
  const BoardView view{2, 20, 10, 15};
  const auto detection = LoneTarget().Detect(*RenderFeatures(view), *BoardCamera(), 1);
  ASSERT_TRUE(detection);
  ASSERT_GE(detection->points.size(), 50u);
  for (std::size_t i = 0; i < detection->points.size(); ++i) {
    const TargetDetection::Point& point = detection->points[i];
    if (i > 0) {
      EXPECT_GT(point.id, detection->points[i - 1].id);
    }
    EXPECT_EQ(point.point_in_target.z(), 0);
    EXPECT_LE(std::abs(point.point_in_target.x()), LoneTarget().width_m() / 2);
    EXPECT_LE(std::abs(point.point_in_target.y()), LoneTarget().height_m() / 2);
    const auto expected = BoardCamera()->Project(TruePoseOfTarget(view) * point.point_in_target);
    ASSERT_TRUE(expected);
    EXPECT_LT((*expected - point.pixel).norm(), 2.5);
  }
}

TEST(PlanarTarget, ScalesThePoseWithItsWidth) {
  const BoardView view{2, 20, 0, 0};
  const PlanarTarget half(LoneBoard().image, LoneBoard().width_m / 2);
  const auto detection = half.Detect(*RenderFeatures(view), *BoardCamera(), 1);
  ASSERT_TRUE(detection);
  EXPECT_LT((detection->camera_from_target.translation - TruePoseOfTarget(view).translation / 2).norm(),
            0.005);
}

TEST(PlanarTarget, IsDetectedInOtherLightAndBlurred) {
  const BoardView view{2, 25, 10, 30};
  const cv::Mat image = LoneBoard().world.Render(
      *BoardCamera(), LookAtBoard(view.distance, view.slant_deg, view.rise_deg, view.roll_deg), 1.5);
  cv::Mat dim, blurred;
  image.convertTo(dim, -1, 0.45, 10);
  cv::GaussianBlur(image, blurred, {}, 1.8);
  for (const cv::Mat& changed : {dim, blurred}) {
    const auto detection = LoneTarget().Detect(*MakeFeatures(changed), *BoardCamera(), 1);
    ASSERT_TRUE(detection);
    EXPECT_LT((detection->camera_from_target.translation - TruePoseOfTarget(view).translation).norm(), 0.02);
    EXPECT_LT(RotationErrorDeg(detection->camera_from_target, TruePoseOfTarget(view)), 0.7);
  }
}

TEST(PlanarTarget, IsDetectedWhenAThirdIsOccluded) {
  const BoardView view{2, 10, 0, 0};
  cv::Mat image = LoneBoard().world.Render(*BoardCamera(), LookAtBoard(2, 10, 0, 0), 1.5);
  image(cv::Rect(0, 0, 250, 480)) = cv::Scalar(60);
  const auto detection = LoneTarget().Detect(*MakeFeatures(image), *BoardCamera(), 1);
  ASSERT_TRUE(detection);
  EXPECT_LT((detection->camera_from_target.translation - TruePoseOfTarget(view).translation).norm(), 0.02);
}

TEST(PlanarTarget, IsDetectedThroughAWideLens) {
  const CameraModel camera(LensModel::kFov, {640, 480, 330, 330, 322, 236}, {0.9});
  const Rigid3 pose = LookAtBoard(1.5, 25, 10, 5);
  const auto detection =
      LoneTarget().Detect(*MakeFeatures(LoneBoard().world.Render(camera, pose, 1.5)), camera, 1);
  ASSERT_TRUE(detection);
  const Rigid3 truth = pose * LoneBoard().world_from_target;
  EXPECT_LT((detection->camera_from_target.translation - truth.translation).norm(), 0.01);
  EXPECT_LT(RotationErrorDeg(detection->camera_from_target, truth), 0.5);
}

TEST(PlanarTarget, IsNeverDetectedInOtherImages) {
  for (std::uint64_t seed = 500; seed < 512; ++seed) {
    const TargetScene other(seed);
    const auto features = MakeFeatures(other.world.Render(*BoardCamera(), LookAtBoard(2, 15, 5, 10), 1.5));
    EXPECT_FALSE(LoneTarget().Detect(*features, *BoardCamera(), seed)) << seed;
  }
  EXPECT_FALSE(LoneTarget().Detect(*MakeFeatures(NoiseImage(640, 480, 3)), *BoardCamera(), 1));
  EXPECT_FALSE(
      LoneTarget().Detect(*MakeFeatures(cv::Mat(480, 640, CV_8UC1, cv::Scalar(90))), *BoardCamera(), 1));
}

TEST(PlanarTarget, IsNotDetectedMirroredOrFromBehind) {
  const TargetScene& scene = LoneBoard();
  cv::Mat mirrored;
  cv::flip(scene.world.Render(*BoardCamera(), LookAtBoard(2, 15, 5, 0), 1.5), mirrored, 1);
  EXPECT_FALSE(LoneTarget().Detect(*MakeFeatures(mirrored), *BoardCamera(), 1));
}

TEST(PlanarTargetAlignment, ReachesTheTruthFromANearbyPose) {
  const BoardView view{2, 20, 10, 15};
  const auto features = RenderFeatures(view);
  Random random(4);
  int reached = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix<double, 6, 1> twist;
    for (int i = 0; i < 6; ++i) twist[i] = random.Uniform(-1, 1) * (i < 3 ? 0.03 : 0.012);
    const auto detection =
        LoneTarget().Align(*features, *BoardCamera(), Rigid3::Exp(twist) * TruePoseOfTarget(view));
    if (!detection) continue;
    ++reached;
    EXPECT_LT((detection->camera_from_target.translation - TruePoseOfTarget(view).translation).norm(), 0.01);
    EXPECT_LT(RotationErrorDeg(detection->camera_from_target, TruePoseOfTarget(view)), 0.4);
  }
  EXPECT_GE(reached, 18);
}

TEST(PlanarTargetAlignment, RejectsAPoseFromWhichItIsNotVisible) {
  const BoardView view{2, 20, 10, 15};
  const auto features = RenderFeatures(view);
  const Rigid3 aside = Rigid3(Rotation3(), {0.6, 0.2, 0}) * TruePoseOfTarget(view);
  EXPECT_FALSE(LoneTarget().Align(*features, *BoardCamera(), aside));
  const Rigid3 behind(Rotation3::Exp({0, kPi, 0}) * TruePoseOfTarget(view).rotation,
                      TruePoseOfTarget(view).translation);
  EXPECT_FALSE(LoneTarget().Align(*features, *BoardCamera(), behind));
}

TEST(PlanarTargetConstruction, RejectsImagesAndWidthsThatCannotWork) {
  EXPECT_THROW(PlanarTarget(LoneBoard().image, 0), Error);
  EXPECT_THROW(PlanarTarget(LoneBoard().image, -1), Error);
  EXPECT_THROW(PlanarTarget(LoneBoard().image, std::nan("")), Error);
  EXPECT_THROW(PlanarTarget(cv::Mat(50, 300, CV_8UC1, cv::Scalar(0)), 1), Error);
  EXPECT_THROW(PlanarTarget(cv::Mat(300, 300, CV_8UC1, cv::Scalar(90)), 1), Error);
}

}  // namespace
}  // namespace docent::engine
