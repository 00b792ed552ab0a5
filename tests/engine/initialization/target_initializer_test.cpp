// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/target_initializer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/vision/features.h"
#include "tests/engine/initialization/target_scene.h"

namespace docent::engine {
namespace {

using testing_world::BoardCamera;
using testing_world::CameraAt;
using testing_world::TargetScene;

const TargetScene& BoardAmongObjects() {
  static const TargetScene scene(31, true);
  return scene;
}
std::shared_ptr<const ImageFeatures> Look(const Rigid3& camera_from_world) {
  return MakeFeatures(BoardAmongObjects().world.Render(*BoardCamera(), camera_from_world, 1.5));
}
TargetInitializer MakeInitializer() {
  static const auto target =
      std::make_shared<const PlanarTarget>(BoardAmongObjects().image, BoardAmongObjects().width_m);
  return TargetInitializer(target, {}, BoardCamera(), 1);
}

TEST(TargetInitializer, StartsAMapInMetresAfterSidewaysMotion) {
  TargetInitializer initializer = MakeInitializer();
  std::optional<TargetStart> start;
  std::vector<Rigid3> poses;
  for (int frame = 0; frame < 20 && !start; ++frame) {
    poses.push_back(CameraAt({-0.1 + 0.02 * frame, 0.05, 0.1}, {0, -0.5 * frame, 0}));
    start = initializer.Track(std::chrono::milliseconds(33 * frame), Look(poses.back()));
    if (!start) {
      ASSERT_TRUE(initializer.detection()) << frame;
      const Rigid3 truth = poses.back() * BoardAmongObjects().world_from_target;
      EXPECT_TRUE(IsNear(initializer.detection()->camera_from_target, truth, 0.01, 0.008)) << frame;
      EXPECT_NE(initializer.hint(), Hint::kNone);
    }
  }
  ASSERT_TRUE(start);
  const auto pose_at = [&](Timestamp time) {
    return poses[static_cast<std::size_t>(time / std::chrono::milliseconds(33))];
  };
  const Rigid3 pose_a = pose_at(start->pair.a.time), pose_b = pose_at(start->pair.b.time);
  const Rigid3 b_from_a = pose_b * pose_a.inverse();
  const double baseline_m = b_from_a.translation.norm();
  EXPECT_NEAR(start->pair.baseline_m, baseline_m, 0.03 * baseline_m);
  EXPECT_TRUE(IsNear(start->a_from_target, pose_a * BoardAmongObjects().world_from_target, 0.01, 0.008));
  EXPECT_NEAR(start->pair.geometry.b_from_a.translation.norm(), 1, 1e-9);
  EXPECT_LT((start->pair.geometry.b_from_a.rotation.inverse() * b_from_a.rotation).Angle(), 0.008);

  const TwoViewResult& geometry = start->pair.geometry;
  EXPECT_EQ(geometry.outcome, TwoViewOutcome::kGeneral);
  ASSERT_EQ(geometry.points_in_a.size(), start->pair.matches.size());
  ASSERT_EQ(geometry.inlier.size(), start->pair.matches.size());
  EXPECT_EQ(geometry.inlier_count, std::count(geometry.inlier.begin(), geometry.inlier.end(), true));
  EXPECT_GE(geometry.inlier_count, 80);
  std::vector<double> errors;
  int beside = 0;
  for (std::size_t i = 0; i < start->pair.matches.size(); ++i) {
    const auto hit = BoardAmongObjects().world.AtPixel(*BoardCamera(), pose_a,
                                                       start->pair.matches[i].pixel_a.cast<double>());
    ASSERT_TRUE(hit);
    beside += hit->wall != 0;
    const Eigen::Vector3d in_world =
        pose_a.inverse() * Eigen::Vector3d(start->pair.baseline_m * geometry.points_in_a[i]);
    errors.push_back((in_world - hit->point).norm() / hit->point.z());
  }
  EXPECT_GT(beside, 10);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.01);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.08);
}

TEST(TargetInitializer, DoesNotStartFromPureRotation) {
  TargetInitializer initializer = MakeInitializer();
  for (int frame = 0; frame < 12; ++frame) {
    EXPECT_FALSE(initializer.Track(std::chrono::milliseconds(33 * frame),
                                   Look(CameraAt({0, 0, 0}, {0, 0.8 * frame, 0}))));
    EXPECT_EQ(initializer.hint(), frame == 0 ? Hint::kMoveSideways : Hint::kMoveFurther);
  }
}

TEST(TargetInitializer, AsksForATargetThatIsNotInView) {
  TargetInitializer initializer = MakeInitializer();
  const auto away = Look(CameraAt({0, 0, 0}, {0, 180, 0}));
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_FALSE(initializer.Track(std::chrono::milliseconds(33 * frame), away));
    EXPECT_FALSE(initializer.detection());
    EXPECT_EQ(initializer.hint(), Hint::kFindTarget);
  }
}

TEST(TargetInitializer, DetectsTheTargetAgainAfterItWasOutOfView) {
  TargetInitializer initializer = MakeInitializer();
  const Rigid3 pose = CameraAt({0.1, 0, 0});
  initializer.Track(Timestamp(0), Look(CameraAt({0, 0, 0})));
  ASSERT_TRUE(initializer.detection());
  for (int frame = 1; frame < 4; ++frame)
    initializer.Track(std::chrono::milliseconds(33 * frame), Look(CameraAt({0, 0, 0}, {0, 180, 0})));
  EXPECT_FALSE(initializer.detection());
  // No corner can be tracked across the gap: the view before it must not initialize a map.
  EXPECT_FALSE(initializer.Track(std::chrono::milliseconds(200), Look(pose)));
  ASSERT_TRUE(initializer.detection());
  EXPECT_TRUE(IsNear(initializer.detection()->camera_from_target,
                     pose * BoardAmongObjects().world_from_target, 0.01, 0.008));
}

TEST(TargetStart, NeedsParallaxAndPoints) {
  const PlanarTarget target(BoardAmongObjects().image, BoardAmongObjects().width_m);
  const auto view = [&](double right) {
    const auto features = Look(CameraAt({right, 0, 0}));
    return TargetView{{Timestamp(0), features}, *target.Detect(*features, *BoardCamera(), 1)};
  };
  const TargetView a = view(0), near = view(0.03), far = view(0.3);
  Hint hint = Hint::kNone;
  EXPECT_FALSE(MakeTargetStart(BoardCamera(), a, a, {}, {}, &hint));
  EXPECT_EQ(hint, Hint::kMoveSideways);
  EXPECT_FALSE(MakeTargetStart(BoardCamera(), a, near, {}, {}, &hint));
  EXPECT_EQ(hint, Hint::kMoveFurther);
  const auto start = MakeTargetStart(BoardCamera(), a, far, {}, {}, &hint);
  ASSERT_TRUE(start);
  EXPECT_EQ(hint, Hint::kNone);
  EXPECT_EQ(start->pair.geometry.outcome, TwoViewOutcome::kPlanar);
  EXPECT_NEAR(start->pair.baseline_m, 0.3, 0.01);
  TargetStartOptions many;
  many.min_matches = 1000;
  EXPECT_FALSE(MakeTargetStart(BoardCamera(), a, far, {}, many, &hint));
  EXPECT_EQ(hint, Hint::kFindMoreDetail);
}

}  // namespace
}  // namespace docent::engine
