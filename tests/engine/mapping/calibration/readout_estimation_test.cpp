// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/readout_estimation.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "engine/base/random.h"
#include "engine/mapping/calibration/readout_calibration.h"

namespace docent::engine {
namespace {

const auto kCamera = std::make_shared<const CameraModel>(
    LensModel::kRadialTangential, CameraModel::Intrinsics{640, 480, 500, 500, 319.5, 239.5},
    std::array<double, 5>{});
constexpr double kNoise_px = 0.5;

// Numbers are drawn in an order that no compiler may change.
Eigen::Vector2d Normal(Random* random) {
  const double radius = std::sqrt(-2 * std::log(1 - random->Uniform()));
  const double angle = 2 * std::numbers::pi * random->Uniform();
  return radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

// A hand that turns to and fro about all axes.
Eigen::Vector3d RateAt(int frame) {
  return {0.5 * std::sin(0.9 * frame), 0.8 * std::sin(0.7 * frame + 1), 0.4 * std::sin(1.3 * frame + 2)};
}

std::shared_ptr<const CameraModel> Image(int frame, const Eigen::Vector2d& readout_s) {
  return std::make_shared<CameraModel>(CameraModel::WithReadout(kCamera, {RateAt(frame), readout_s}));
}

// What `cameras` images see of a room while the camera moves sideways, with a shutter that takes `readout_s`;
// the models assume `assumed_s`.
BundleProblem Scene(int cameras, const Eigen::Vector2d& readout_s, const Eigen::Vector2d& assumed_s,
                    std::uint64_t seed) {
  Random random(seed);
  BundleProblem problem;
  for (int i = 0; i < cameras; ++i) {
    const Rotation3 rotation = Rotation3::Exp(0.1 * RateAt(i));
    problem.cameras.push_back(
        {Image(i, assumed_s), Rigid3(rotation, rotation * Eigen::Vector3d(-0.15 * i, 0.02 * i, 0)), i == 0});
  }
  for (int p = 0; p < 400; ++p) {
    const double depth = random.Uniform(2, 6);
    const double x = random.Uniform(-0.6, 0.6), y = random.Uniform(-0.45, 0.45);
    const Eigen::Vector3d point(x * depth, y * depth, depth);
    problem.points.push_back({point, false});
    for (int i = 0; i < cameras; ++i) {
      const auto pixel =
          Image(i, readout_s)->Project(problem.cameras[static_cast<std::size_t>(i)].camera_from_map * point);
      if (!pixel || !kCamera->IsInside(*pixel)) continue;
      const Eigen::Vector2d noise = kNoise_px * Normal(&random);
      problem.measurements.push_back({i, p, (*pixel + noise).cast<float>(), 1, false});
    }
  }
  return problem;
}

std::vector<char> All(const BundleProblem& problem) {
  return std::vector<char>(problem.cameras.size(), 1);
}

TEST(ReadoutEstimation, FindsTheReadoutTimeOfAMapThatWasAdjustedWithoutIt) {
  for (const double readout_s : {-0.03, 0.01, 0.02, 0.03}) {
    for (int axis = 0; axis < 2; ++axis) {
      Eigen::Vector2d truth = Eigen::Vector2d::Zero();
      truth[axis] = readout_s;
      BundleProblem problem = Scene(6, truth, Eigen::Vector2d::Zero(), 1);
      std::optional<ReadoutEstimate> estimate;
      for (int round = 0; round < 4; ++round) {
        ASSERT_NE(AdjustBundle({}, &problem).outcome, BundleSummary::Outcome::kFailed);
        estimate = EstimateReadout({}, All(problem), problem);
        ASSERT_TRUE(estimate);
        // Robust weights attenuate the first estimate: measurements that disagree most count least.
        EXPECT_NEAR(estimate->readout_s[axis], readout_s, (round == 0 ? 0.3 : 0.1) * std::abs(readout_s));
        EXPECT_GT(std::abs(estimate->readout_s[axis]), 10 * estimate->sigma_s[axis]);
        Eigen::Vector2d next = Eigen::Vector2d::Zero();
        next[axis] = estimate->readout_s[axis];
        for (int i = 0; i < 6; ++i) problem.cameras[static_cast<std::size_t>(i)].model = Image(i, next);
      }
      EXPECT_NEAR(estimate->readout_s[axis], readout_s, 0.0015);  // The worst of 160 was off by 0.0013.
    }
  }
}

TEST(ReadoutEstimation, IsExactWhereTheAssumedReadoutTimeIsRight) {
  int within = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    BundleProblem problem = Scene(6, {0, 0.02}, {0, 0.02}, seed);
    ASSERT_NE(AdjustBundle({}, &problem).outcome, BundleSummary::Outcome::kFailed);
    const auto estimate = EstimateReadout({}, All(problem), problem);
    ASSERT_TRUE(estimate);
    within += std::abs(estimate->readout_s.y() - 0.02) < 2 * estimate->sigma_s.y();
    EXPECT_NEAR(estimate->readout_s.y(), 0.02, 4 * estimate->sigma_s.y()) << "seed " << seed;
  }
  EXPECT_GE(within, 17) << "two standard deviations contained 196 of 200";
}

// What is left of the robust weights' attenuation.
TEST(ReadoutEstimation, IsOffByLessThanFourDeviationsWhereTheAssumedReadoutTimeIsNearlyRight) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    BundleProblem problem = Scene(6, {0, 0.02}, {0, 0.018}, seed);
    ASSERT_NE(AdjustBundle({}, &problem).outcome, BundleSummary::Outcome::kFailed);
    const auto estimate = EstimateReadout({}, All(problem), problem);
    ASSERT_TRUE(estimate);
    EXPECT_NEAR(estimate->readout_s.y(), 0.02, 4 * estimate->sigma_s.y()) << "seed " << seed;
  }
}

TEST(ReadoutEstimation, FindsNoneForAGlobalShutter) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    BundleProblem problem = Scene(5, {0, 0}, {0, 0}, 100 + seed);
    ASSERT_NE(AdjustBundle({}, &problem).outcome, BundleSummary::Outcome::kFailed);
    const auto estimate = EstimateReadout({}, All(problem), problem);
    ASSERT_TRUE(estimate);
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_LT(std::abs(estimate->readout_s[axis]), 4 * estimate->sigma_s[axis]) << "seed " << seed;
    }
  }
}

TEST(ReadoutEstimation, KnowsNothingOfCamerasThatDoNotTurnOrHaveAnotherLens) {
  BundleProblem problem = Scene(5, {0, 0.02}, {0, 0}, 3);
  EXPECT_FALSE(EstimateReadout({.min_rate = 5}, All(problem), problem));
  EXPECT_FALSE(EstimateReadout({}, std::vector<char>(5, 0), problem));
  problem.measurements.resize(100);
  EXPECT_FALSE(EstimateReadout({}, All(problem), problem));
}

TEST(ReadoutEstimation, IgnoresMeasurementsThatAreNotFinite) {
  BundleProblem problem = Scene(6, {0, 0.02}, {0, 0.02}, 4);
  problem.measurements[7].pixel.x() = std::numeric_limits<float>::quiet_NaN();
  problem.points[3].position.setConstant(std::numeric_limits<double>::quiet_NaN());
  problem.points[5].position.z() = -4;  // behind all cameras
  const auto estimate = EstimateReadout({}, All(problem), problem);
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->readout_s.y(), 0.02, 0.002);
}

TEST(ReadoutEstimation, NeverExceedsTheLargestReadoutTime) {
  const BundleProblem problem = Scene(6, {0, 0.05}, {0, 0}, 5);
  const auto estimate = EstimateReadout({.max_readout_s = 0.03}, All(problem), problem);
  ASSERT_TRUE(estimate);
  EXPECT_LE(estimate->readout_s.cwiseAbs().maxCoeff(), 0.03);
}

TEST(ReadoutEstimation, WeighsTheMapAgainstWhatIsKnownAlready) {
  const BundleProblem problem = Scene(6, {0, 0.02}, {0, 0.02}, 5);
  const auto with_prior = [&](double sigma_s) {
    return EstimateReadout({.prior = ReadoutPrior{{0, 0.01}, sigma_s}}, All(problem), problem);
  };
  const auto certain = with_prior(1e-5), vague = with_prior(1);
  ASSERT_TRUE(certain && vague);
  EXPECT_NEAR(certain->readout_s.y(), 0.01, 0.0002);
  EXPECT_NEAR(vague->readout_s.y(), 0.02, 0.001);
  EXPECT_LT(certain->sigma_s.y(), 1.1e-5);
  const auto without = EstimateReadout({}, All(problem), problem);
  ASSERT_TRUE(without);
  const double expected_s =
      std::hypot(kReadoutRateErrors * without->sigma_s.y(), ReadoutEstimationOptions().common_sigma_s);
  EXPECT_NEAR(vague->sigma_s.y(), expected_s, 0.02 * expected_s);
}

TEST(ReadoutEstimation, RefusesOptionsThatMakeNoSense) {
  EXPECT_FALSE(ReadoutEstimationOptions().Validate());
  EXPECT_TRUE((ReadoutEstimationOptions{.prior_sigma_s = 0}).Validate());
  EXPECT_TRUE((ReadoutEstimationOptions{.max_readout_s = -1}).Validate());
  EXPECT_TRUE((ReadoutEstimationOptions{.common_sigma_s = -1}).Validate());
  EXPECT_TRUE((ReadoutEstimationOptions{.min_sigmas = -1}).Validate());
  EXPECT_TRUE((ReadoutEstimationOptions{.min_measurements = 0}).Validate());
}

// The same scene as a map, whose keyframes assume that the shutter is global.
Map MapOf(const BundleProblem& problem) {
  Map map;
  std::vector<KeyFrameId> keyframes;
  for (const BundleProblem::Camera& camera : problem.cameras) {
    KeyFrame keyframe;
    keyframe.camera = camera.model;
    keyframe.camera_from_map = camera.camera_from_map;
    keyframe.fixed = camera.fixed;
    keyframes.push_back(map.AddKeyFrame(keyframe).keyframe.id);
  }
  std::vector<MapPointId> points;
  for (const BundleProblem::Point& point : problem.points) {
    MapPoint added;
    added.point_in_map = point.position.homogeneous();
    added.source_keyframe = keyframes.front();
    points.push_back(map.AddPoint(added));
  }
  for (const BundleProblem::Measurement& m : problem.measurements) {
    map.AddObservation({keyframes[static_cast<std::size_t>(m.camera)],
                        points[static_cast<std::size_t>(m.point)], m.pixel, 0});
  }
  return map;
}

Eigen::Vector2d ReadoutOfNewest(const Map& map) {
  return map.keyframes().rbegin()->second.keyframe.camera->readout_motion().readout_s;
}

TEST(ReadoutCalibration, GivesTheKeyFramesTheirReadoutTimeAndKeepsIt) {
  Map map = MapOf(Scene(6, {0, 0.02}, {0, 0}, 6));
  const KeyFrameId newest = map.keyframes().rbegin()->first;
  const MapAdjustmentOptions adjustment;
  ASSERT_TRUE(CalibrateReadout({}, adjustment, newest, &map).changed);
  for (int round = 0; round < 5; ++round) {
    AdjustLocally(adjustment, newest, nullptr, &map);
    CalibrateReadout({}, adjustment, newest, &map);
  }
  EXPECT_NEAR(ReadoutOfNewest(map).y(), 0.02, 0.001);
  EXPECT_EQ(ReadoutOfNewest(map).x(), 0) << "only rows are exposed one after another";
  AdjustLocally(adjustment, newest, nullptr, &map);
  EXPECT_FALSE(CalibrateReadout({}, adjustment, newest, &map).changed) << "nothing has changed";
}

TEST(ReadoutCalibration, ReturnsAnEstimateThatIsThePriorOfTheNext) {
  Map map = MapOf(Scene(6, {0, 0.02}, {0, 0}, 6));
  const auto newest = [](const Map& of) { return of.keyframes().rbegin()->first; };
  ReadoutEstimationOptions options;
  options.prior = CalibrateReadout(options, {}, newest(map), &map).estimate;
  ASSERT_TRUE(options.prior);
  EXPECT_GT(options.prior->readout_s.y(), 0.01);
  const double first_sigma_s = options.prior->sigma_s;
  for (int round = 0; round < 10; ++round) {
    AdjustLocally({}, newest(map), nullptr, &map);
    options.prior = CalibrateReadout(options, {}, newest(map), &map).estimate;
    ASSERT_TRUE(options.prior);
  }
  EXPECT_NEAR(options.prior->readout_s.y(), 0.02, 0.001);
  EXPECT_LT(options.prior->sigma_s, 0.5 * first_sigma_s);
  // Keyframes that look as if the shutter were another one hardly change it any more.
  Map other = MapOf(Scene(6, {0, 0.01}, {0, 0.02}, 6));
  CalibrateReadout(options, {}, newest(other), &other);
  EXPECT_NEAR(ReadoutOfNewest(other).y(), 0.02, 0.003);
  Map global = MapOf(Scene(6, {0, 0}, {0, 0}, 7));
  EXPECT_FALSE(CalibrateReadout({}, {}, newest(global), &global).estimate);
}

TEST(ReadoutCalibration, CorrectsAPriorThatWasWrong) {
  // The corners of an initialization were wrong by three standard deviations.
  ReadoutEstimationOptions options;
  options.prior = ReadoutPrior{{0, 0.008}, 0.004};
  Map map = MapOf(Scene(6, {0, 0.02}, {0, 0}, 6));
  const KeyFrameId newest = map.keyframes().rbegin()->first;
  for (int round = 0; round < 10; ++round) {
    options.prior = CalibrateReadout(options, {}, newest, &map).estimate;
    ASSERT_TRUE(options.prior);
    AdjustLocally({}, newest, nullptr, &map);
  }
  EXPECT_NEAR(options.prior->readout_s.y(), 0.02, 2 * options.prior->sigma_s);
  EXPECT_LT(options.prior->sigma_s, 0.002);
}

TEST(ReadoutCalibration, KeepsWhatTheCalibrationStates) {
  Map map = MapOf(Scene(6, {0, 0.02}, {0, 0.01}, 6));
  const auto known = std::make_shared<const CameraModel>(kCamera->WithKnownReadout({0, 0.01}));
  for (auto& [id, record] : map.keyframes())
    record.keyframe.camera = CameraModel::WithMotionOf(*record.keyframe.camera, known);
  EXPECT_FALSE(CalibrateReadout({}, {}, map.keyframes().rbegin()->first, &map).changed);
  EXPECT_EQ(ReadoutOfNewest(map).y(), 0.01);
}

TEST(ReadoutCalibration, LeavesAGlobalShutterAndAnUnknownMotionAlone) {
  Map global = MapOf(Scene(6, {0, 0}, {0, 0}, 7));
  EXPECT_FALSE(CalibrateReadout({}, {}, global.keyframes().rbegin()->first, &global).changed);
  EXPECT_TRUE(ReadoutOfNewest(global).isZero(0));
  Map unknown = MapOf(Scene(6, {0, 0.02}, {0, 0}, 8));
  for (auto& [id, record] : unknown.keyframes()) record.keyframe.camera = kCamera;
  EXPECT_FALSE(CalibrateReadout({}, {}, unknown.keyframes().rbegin()->first, &unknown).changed);
  EXPECT_FALSE(CalibrateReadout({}, {}, 99, &unknown).changed) << "there is no such keyframe";
}

TEST(ReadoutCalibration, DoesNothingWhereItIsDisabled) {
  Map map = MapOf(Scene(6, {0, 0.02}, {0, 0}, 9));
  EXPECT_FALSE(CalibrateReadout({.enabled = false}, {}, map.keyframes().rbegin()->first, &map).changed);
}

}  // namespace
}  // namespace docent::engine
