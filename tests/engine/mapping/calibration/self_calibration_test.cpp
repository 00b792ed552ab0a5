// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/self_calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/engine/mapping/calibration/lens_scene.h"

namespace docent::engine {
namespace {

using CalibrationOutcome = SelfCalibration::Outcome;

SelfCalibration Calibrate(LensScene* scene, const SelfCalibrationOptions& options = {}) {
  return CalibrateBundle(options, scene->unknown, &scene->problem);
}

TEST(SelfCalibration, ConvertsAFieldOfViewToAFocalLength) {
  const CameraModel lens = LensWithFieldOfView(640, 480, 90);
  EXPECT_NEAR(lens.intrinsics().fx, 320, 1e-9);
  EXPECT_DOUBLE_EQ(lens.intrinsics().fy, lens.intrinsics().fx);
  EXPECT_DOUBLE_EQ(lens.intrinsics().cx, 319.5);
  EXPECT_DOUBLE_EQ(lens.intrinsics().cy, 239.5);
}

TEST(SelfCalibration, RecoversFocalLengthAndDistortionExactlyWithoutNoise) {
  for (const double degrees : {50.0, 75.0, 90.0}) {
    LensScene scene = MakeLensScene({.field_of_view_deg = degrees, .k1 = -0.1, .noise_px = 0});
    const SelfCalibration result = Calibrate(&scene);
    ASSERT_EQ(result.outcome, CalibrationOutcome::kDone) << degrees;
    // Pixels have single precision, and the prior of k1 causes a small bias.
    EXPECT_NEAR(result.focal_px / scene.true_focal(), 1, 2e-5) << degrees;
    EXPECT_NEAR(result.lens.distortion()[0], -0.1, 1e-5) << degrees;
    EXPECT_LT(result.sigma, 1e-3);
    const auto& model = *scene.problem.cameras.front().model;
    EXPECT_DOUBLE_EQ(model.intrinsics().fx, result.focal_px);
    EXPECT_EQ(model, result.lens);
  }
}

TEST(SelfCalibration, RecoversThePrincipalPointAndK2IfRequested) {
  LensScene scene = MakeLensScene(
      {.field_of_view_deg = 80, .k1 = -0.28, .k2 = 0.07, .center_px = {330, 230}, .noise_px = 0});
  SelfCalibrationOptions options;
  options.k2_prior_sigma = 0.2;
  options.center_prior_sigma = 0.02;
  const SelfCalibration result = Calibrate(&scene, options);
  ASSERT_EQ(result.outcome, CalibrationOutcome::kDone);
  // The priors cause a small bias.
  EXPECT_NEAR(result.focal_px / scene.true_focal(), 1, 2e-3);
  EXPECT_NEAR(result.lens.intrinsics().cx, 330, 0.5);
  EXPECT_NEAR(result.lens.intrinsics().cy, 230, 0.5);
  EXPECT_NEAR(result.lens.distortion()[0], -0.28, 0.01);
  EXPECT_NEAR(result.lens.distortion()[1], 0.07, 0.02);
}

TEST(SelfCalibration, ErrorsAgreeWithTheStandardDeviation) {
  // The root mean square of 40 normal variables lies within 0.65 and 1.35 with a chance of 0.998.
  double squares = 0;
  constexpr int kSeeds = 40;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    LensScene scene = MakeLensScene({.field_of_view_deg = 75,
                                     .k1 = 0.05,
                                     .noise_px = 0.7,
                                     .outlier_ratio = 0.05,
                                     .seed = static_cast<std::uint64_t>(seed)});
    const SelfCalibration result = Calibrate(&scene);
    ASSERT_EQ(result.outcome, CalibrationOutcome::kDone) << seed;
    EXPECT_GE(result.focal_sigma, result.formal_focal_sigma);
    const double error = std::log(result.focal_px / scene.true_focal()) / result.focal_sigma;
    EXPECT_LT(std::abs(error), 4) << seed;
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / kSeeds), 1.35);
  // Clustering by keyframes may overestimate the standard deviation, but not by much.
  EXPECT_GT(std::sqrt(squares / kSeeds), 0.4);
}

TEST(SelfCalibration, TheStandardDeviationIncludesErrorsSharedByAKeyFrame) {
  double squares = 0, formal_squares = 0;
  constexpr int kSeeds = 20;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    LensScene scene = MakeLensScene({.field_of_view_deg = 75,
                                     .noise_px = 0.2,
                                     .keyframe_noise_px = 0.6,
                                     .seed = static_cast<std::uint64_t>(seed)});
    const SelfCalibration result = Calibrate(&scene);
    ASSERT_EQ(result.outcome, CalibrationOutcome::kDone) << seed;
    const double error = std::log(result.focal_px / scene.true_focal());
    squares += std::pow(error / result.focal_sigma, 2);
    formal_squares += std::pow(error / result.formal_focal_sigma, 2);
  }
  // With ten keyframes, the variance of the sums over keyframes is not known precisely.
  EXPECT_LT(std::sqrt(squares / kSeeds), 2);
  EXPECT_GT(formal_squares, 1.5 * squares);
}

TEST(SelfCalibration, TheFocalLengthIsUndeterminedForAFrontalPlaneWithoutRotation) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 75, .noise_px = 0.5, .plane = true, .rotation = 0});
  const SelfCalibration result = Calibrate(&scene);
  EXPECT_TRUE(result.outcome != CalibrationOutcome::kDone || result.focal_sigma > 0.1) << result.focal_sigma;
}

TEST(SelfCalibration, TheFocalLengthIsUndeterminedWithoutRotation) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 75, .noise_px = 0.5, .rotation = 0});
  const SelfCalibration result = Calibrate(&scene);
  EXPECT_TRUE(result.outcome != CalibrationOutcome::kDone || result.focal_sigma > 0.1) << result.focal_sigma;
}

TEST(SelfCalibration, FindsAFocalLengthFarFromTheInitialOne) {
  SelfCalibrationOptions options;
  options.fields_of_view_deg = {40, 60, 80, 100};
  for (const double degrees : {45.0, 100.0}) {
    LensScene scene = MakeLensScene({.field_of_view_deg = degrees, .noise_px = 0.3, .from_60_degrees = true});
    const SelfCalibration result = Calibrate(&scene, options);
    ASSERT_EQ(result.outcome, CalibrationOutcome::kDone) << degrees;
    EXPECT_LT(std::abs(std::log(result.focal_px / scene.true_focal())), 4 * result.focal_sigma) << degrees;
    EXPECT_LT(result.focal_sigma, 0.02) << degrees;
  }
}

TEST(SelfCalibration, KeepsTheScaleAndTheFixedCamera) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 85, .noise_px = 0.1, .from_60_degrees = true});
  const BundleProblem before = scene.problem;
  ASSERT_EQ(Calibrate(&scene).outcome, CalibrationOutcome::kDone);
  EXPECT_TRUE(
      IsNear(scene.problem.cameras[0].camera_from_map, before.cameras[0].camera_from_map, 1e-9, 1e-9));
  std::vector<double> ratios;
  for (const BundleProblem::Measurement& measurement : before.measurements) {
    if (measurement.camera != 0) continue;
    const auto p = static_cast<std::size_t>(measurement.point);
    const Rigid3& pose = before.cameras[0].camera_from_map;
    ratios.push_back((pose * scene.problem.points[p].position).head<2>().norm() /
                     (pose * before.points[p].position).head<2>().norm());
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  EXPECT_NEAR(ratios[ratios.size() / 2], 1, 0.02);
}

TEST(SelfCalibration, DoesNotChangeKnownLenses) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 75, .noise_px = 0.2});
  // Every other image is from another camera with a known lens.
  const auto known =
      std::make_shared<const CameraModel>(LensWithFocalLength(640, 480, scene.true_focal(), 0));
  for (std::size_t i = 0; i < scene.problem.cameras.size(); i += 2) {
    scene.problem.cameras[i].model = known;
    scene.unknown[i] = 0;
  }
  const SelfCalibration result = Calibrate(&scene);
  ASSERT_EQ(result.outcome, CalibrationOutcome::kDone);
  EXPECT_LT(std::abs(std::log(result.focal_px / scene.true_focal())), 4 * result.focal_sigma);
  EXPECT_EQ(scene.problem.cameras[0].model, known);
  EXPECT_NE(scene.problem.cameras[1].model, known);
}

TEST(SelfCalibration, AdjustsPosesAndPointsToALensThatTheCallerChanged) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 75, .noise_px = 0, .from_60_degrees = true});
  const auto lens = std::make_shared<const CameraModel>(LensWithFieldOfView(640, 480, 75));
  for (BundleProblem::Camera& camera : scene.problem.cameras) camera.model = lens;
  SelfCalibrationOptions options;
  options.refine_lens = false;
  const SelfCalibration result = Calibrate(&scene, options);
  ASSERT_EQ(result.outcome, CalibrationOutcome::kDone);
  EXPECT_EQ(scene.problem.cameras[0].model, lens);
  EXPECT_LT(result.sigma, 1e-3);
}

TEST(SelfCalibration, FailsWithoutChangesIfThereAreTooFewMeasurements) {
  LensScene scene = MakeLensScene({.points = 5});
  const auto before = scene.problem.cameras[1].camera_from_map;
  EXPECT_EQ(Calibrate(&scene).outcome, CalibrationOutcome::kFailed);
  EXPECT_TRUE(IsNear(scene.problem.cameras[1].camera_from_map, before, 0, 0));
}

TEST(SelfCalibration, ChangesNothingWhenInterrupted) {
  LensScene scene = MakeLensScene({});
  const auto before = scene.problem.cameras[1];
  const std::atomic<bool> interrupt = true;
  SelfCalibrationOptions options;
  options.interrupt = &interrupt;
  EXPECT_EQ(Calibrate(&scene, options).outcome, CalibrationOutcome::kInterrupted);
  EXPECT_EQ(scene.problem.cameras[1].model, before.model);
  EXPECT_TRUE(IsNear(scene.problem.cameras[1].camera_from_map, before.camera_from_map, 0, 0));
}

}  // namespace
}  // namespace docent::engine
