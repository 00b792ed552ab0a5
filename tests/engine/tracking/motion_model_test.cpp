// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/motion_model.h"

#include <gtest/gtest.h>

#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;

// The pose of a camera with a constant twist of 0.3 m/s and 30 degrees per second.
Rigid3 Screw(double seconds) {
  Vector6 twist;
  twist << 0.3, -0.1, 0.05, 0.1, 0.5, -0.1;
  return Rigid3::Exp(seconds * twist) * CameraAt({1, 2, 3}, {10, 20, 30});
}

TEST(MotionModel, LearnsAConstantVelocity) {
  MotionModel model;
  model.Reset(FromSeconds(0), Screw(0));
  for (int i = 1; i <= 20; ++i) model.Update(FromSeconds(i / 30.0), Screw(i / 30.0));
  EXPECT_TRUE(IsNear(model.Predict(FromSeconds(21 / 30.0)), Screw(21 / 30.0), 1e-4, 1e-4));
  EXPECT_TRUE(IsNear(model.Predict(FromSeconds(23 / 30.0)), Screw(23 / 30.0), 1e-4, 1e-4));
}

TEST(MotionModel, KeepsTheVelocityWhereTwoImagesHaveNearlyTheSameTime) {
  MotionModel model;
  model.Reset(FromSeconds(0), Screw(0));
  for (int i = 1; i <= 20; ++i) model.Update(FromSeconds(i / 30.0), Screw(i / 30.0));
  const double velocity = model.twist_per_second().norm();
  model.Update(FromSeconds(20 / 30.0 + 0.001), Screw(21 / 30.0));  // stamped when it arrived
  EXPECT_LT(model.twist_per_second().norm(), 2 * velocity);
  EXPECT_NEAR(model.SecondsUntil(FromSeconds(22 / 30.0)), 2 / 30.0 - 0.001, 1e-9);
  EXPECT_LE(model.SecondsUntil(FromSeconds(20 / 30.0)), 0);
}

TEST(MotionModel, PredictsNoMotionAfterAResetOrForThePast) {
  MotionModel model;
  for (int i = 0; i <= 5; ++i) model.Update(FromSeconds(i / 30.0), Screw(i / 30.0));
  EXPECT_TRUE(IsNear(model.Predict(FromSeconds(5 / 30.0)), Screw(5 / 30.0), 1e-12, 1e-12));
  EXPECT_TRUE(IsNear(model.Predict(FromSeconds(1 / 30.0)), Screw(5 / 30.0), 1e-12, 1e-12));
  model.Reset(FromSeconds(1), Screw(1));
  EXPECT_TRUE(IsNear(model.Predict(FromSeconds(2)), Screw(1), 1e-12, 1e-12));
}

TEST(MotionModel, LimitsThePredictionOverALongGap) {
  MotionModel model;
  model.Reset(FromSeconds(0), Screw(0));
  for (int i = 1; i <= 20; ++i) model.Update(FromSeconds(i / 30.0), Screw(i / 30.0));
  const Rigid3 later = model.Predict(FromSeconds(100));
  EXPECT_TRUE(IsNear(later, Screw(20 / 30.0 + 0.2), 1e-3, 1e-3));
}

TEST(MotionModel, DampsTheVelocityWhileTrackingFails) {
  MotionModel model;
  model.Reset(FromSeconds(0), Screw(0));
  for (int i = 1; i <= 20; ++i) model.Update(FromSeconds(i / 30.0), Screw(i / 30.0));
  double step = 1;
  for (int i = 21; i < 40; ++i) {
    const Rigid3 before = model.last();
    model.Miss(FromSeconds(i / 30.0));
    const double next_step = (model.last() * before.inverse()).Log().norm();
    EXPECT_LT(next_step, 0.6 * step);
    step = next_step;
  }
  EXPECT_LT(step, 1e-5);
}

TEST(MotionModel, HandlesTwoImagesWithTheSameTime) {
  MotionModel model;
  model.Reset(FromSeconds(1), Screw(0));
  model.Update(FromSeconds(1), Screw(0.1));
  EXPECT_TRUE(model.Predict(FromSeconds(1.1)).translation.allFinite());
  EXPECT_TRUE(IsNear(model.last(), Screw(0.1), 1e-12, 1e-12));
}

TEST(MotionModel, RotatesAboutTheCentreWhenOnlyTheRotationIsKnown) {
  MotionModel model;
  model.Reset(FromSeconds(0), Screw(0));
  const Rotation3 turn = Rotation3::Exp({0.1, -0.2, 0.05});
  const Rigid3 predicted = model.PredictWithRotation(turn);
  EXPECT_LT((predicted.OriginInSource() - Screw(0).OriginInSource()).norm(), 1e-12);
  EXPECT_LT((predicted.rotation.inverse() * (turn * Screw(0).rotation)).Angle(), 1e-12);
}

TEST(MotionModel, MeasuresTheVelocityFromTheTimeOfTheCentre) {
  MotionModel model;
  const Eigen::Vector3d rate(0, 1.5, 0), velocity(0.3, 0, 0);
  const auto at = [&](double seconds, double centre_seconds) {
    const Rotation3 rotation = Rotation3::Exp(rate * seconds);
    return Rigid3(rotation, -(rotation * Eigen::Vector3d(velocity * centre_seconds)));
  };
  // The rotation was tracked for half a second, and the centre is that of the beginning.
  model.Reset(FromSeconds(0.5), at(0.5, 0));
  model.SetRotating(FromSeconds(0), rate);
  const Rigid3 predicted = model.Predict(FromSeconds(0.6));
  EXPECT_LT((predicted.rotation.inverse() * at(0.6, 0).rotation).Angle(), 1e-9);
  EXPECT_LT(predicted.OriginInSource().norm(), 1e-9);
  model.Update(FromSeconds(0.6), at(0.6, 0.6));
  EXPECT_NEAR(model.twist_per_second().head<3>().norm(), 0.6 * velocity.norm(), 0.02);
  model.Update(FromSeconds(0.7), at(0.7, 0.7));
  EXPECT_LT(model.twist_per_second().head<3>().norm(), 1.1 * velocity.norm());
}

// The frame of a loss has been predicted with the velocity already: the rotation of its image must not be
// added to that.
TEST(MotionModel, RotatesThePoseBeforeALossInTheFrameOfTheLoss) {
  MotionModel model;
  model.Reset(FromSeconds(0), Screw(0));
  for (int i = 1; i <= 20; ++i) model.Update(FromSeconds(i / 30.0), Screw(i / 30.0));
  const Rotation3 turn = Rotation3::Exp({0.1, -0.2, 0.05});
  const Rotation3 turned = turn * Screw(20 / 30.0).rotation;
  model.Miss(FromSeconds(21 / 30.0));
  Rigid3 predicted = model.PredictWithRotation(FromSeconds(21 / 30.0), turn);
  EXPECT_LT((predicted.OriginInSource() - Screw(20 / 30.0).OriginInSource()).norm(), 1e-9);
  EXPECT_LT((predicted.rotation.inverse() * turned).Angle(), 1e-9);
  // What was searched in vain stays the prediction for this frame, and is rotated for the next one.
  model.Reset(FromSeconds(21 / 30.0), predicted);
  predicted = model.PredictWithRotation(FromSeconds(21 / 30.0), turn);
  EXPECT_LT((predicted.rotation.inverse() * turned).Angle(), 1e-9);
  predicted = model.PredictWithRotation(FromSeconds(22 / 30.0), turn);
  EXPECT_LT((predicted.rotation.inverse() * (turn * turned)).Angle(), 1e-9);
}

}  // namespace
}  // namespace docent::engine
