// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/false_initialization.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "engine/base/error.h"
#include "engine/geometry/sim3.h"
#include "tests/app/support/known_run.h"

namespace docent::app {
namespace {

using engine::Rotation3;
using engine::TrackingState;

constexpr int kRunFrames = 90;   // three seconds
constexpr int kFirstDepth = 15;  // the frame at which the map gets depth
constexpr double kSceneDepth_m = 2;

// A camera that moves sideways at `speed_m` metres per second on a curve, and rotates slightly.
std::vector<TimedPose> Sideways(double speed_m) {
  std::vector<TimedPose> poses;
  for (int i = 0; i < kRunFrames; ++i) {
    const double t = i / 30.0;
    poses.push_back({TimeOf(i),
                     {Rotation3::Exp({0.02 * t, 0.1 * t, 0}),
                      speed_m * Eigen::Vector3d(t, 0.1 * std::sin(3 * t), 0.05 * t * t)}});
  }
  return poses;
}

// A run with the estimated camera poses `estimated`, whose map was initialized from the keyframes 0 and
// kFirstDepth.
RunRecord RunOf(const std::vector<TimedPose>& estimated, double depth_m = kSceneDepth_m) {
  RunRecord run;
  for (int i = kFirstDepth; i < kRunFrames; ++i) {
    FrameRecord frame;
    frame.time = TimeOf(i);
    frame.state = TrackingState::kSixDof;
    frame.map_key = 1;
    frame.camera_from_map = CameraFromMap(estimated[static_cast<std::size_t>(i)].truth_from_camera);
    frame.median_depth = depth_m / kTruthFromMap.scale;
    run.frames.push_back(frame);
  }
  InitializationRecord start;
  start.map_key = 1;
  for (int i = 0; i < 20; ++i)
    start.points.push_back({Eigen::Vector2f::Zero(), run.frames[0].median_depth * (0.5 + 0.05 * i)});
  for (const int i : {0, kFirstDepth})
    start.keyframes.push_back(
        {TimeOf(i), CameraFromMap(estimated[static_cast<std::size_t>(i)].truth_from_camera)});
  run.initializations.push_back(start);
  MapRecord map;
  map.key = 1;
  run.maps.push_back(map);
  return run;
}

// The options for ground truth without noise.
FalseInitializationOptions Exact() {
  FalseInitializationOptions options;
  options.truth_noise_m = 0;
  return options;
}

InitializationResult Judge(const RunRecord& run, const std::vector<TimedPose>& truth,
                           const TrueDepthSource& true_depths = {},
                           const FalseInitializationOptions& options = Exact()) {
  const std::vector<InitializationResult> results = ClassifyInitializations(run, truth, true_depths, options);
  EXPECT_EQ(results.size(), 1u);
  return results.at(0);
}

// True depths that are `factor` times the depths of the map.
TrueDepthSource Depths(double factor, double sigma = 0) {
  return [=](const InitializationRecord& start) {
    TrueDepths depths;
    for (const InitializationRecord::Point& point : start.points)
      depths.push_back(TrueDepth{1 / (factor * kTruthFromMap.scale * point.depth), sigma});
    return depths;
  };
}

TEST(FalseInitialization, IsNotReportedForACorrectMapInAnyFrameAndScale) {
  const auto truth = Sideways(0.3);
  const InitializationResult result = Judge(RunOf(truth), truth);
  EXPECT_EQ(result.outcome, InitializationOutcome::kRight);
  EXPECT_NEAR(result.error_m, 0, 1e-9);
  EXPECT_THAT(result.depth_m, ::testing::Optional(::testing::DoubleNear(kSceneDepth_m, 1e-6)));
  EXPECT_NEAR(result.path_m, result.true_path_m, 1e-9);
  EXPECT_NEAR(result.window_s, 1, 0.04);
}

TEST(FalseInitialization, DetectsAWrongDirectionOfMotion) {
  const auto truth = Sideways(0.3);
  auto estimated = truth;
  for (TimedPose& pose : estimated) {  // forwards instead of sideways, with the same orientations
    Eigen::Vector3d& t = pose.truth_from_camera.translation;
    t = {t.z(), t.y(), t.x()};
  }
  EXPECT_EQ(Judge(RunOf(estimated), truth).outcome, InitializationOutcome::kFalsePath);
}

TEST(FalseInitialization, DetectsAReversedMotion) {
  const auto truth = Sideways(0.3);
  auto estimated = truth;
  for (TimedPose& pose : estimated) pose.truth_from_camera.translation *= -1;
  const InitializationResult result = Judge(RunOf(estimated), truth);
  EXPECT_EQ(result.outcome, InitializationOutcome::kFalsePath);
  EXPECT_EQ(result.path_m, 0);
}

TEST(FalseInitialization, DetectsAScaleChangeWithinTheFirstSecond) {
  const auto truth = Sideways(0.3);
  auto estimated = truth;
  for (std::size_t i = kFirstDepth; i < estimated.size(); ++i) {
    const Eigen::Vector3d from = truth[kFirstDepth].truth_from_camera.translation;
    Eigen::Vector3d& t = estimated[i].truth_from_camera.translation;
    t = from + 0.2 * (t - from);  // the keyframes' baseline was five times too long
  }
  EXPECT_EQ(Judge(RunOf(estimated), truth).outcome, InitializationOutcome::kFalsePath);
}

TEST(FalseInitialization, DetectsATranslationOfARotatingCamera) {
  const auto truth = Sideways(0);
  const auto estimated = Sideways(0.1);
  const InitializationResult result = Judge(RunOf(estimated), truth, Depths(1));
  EXPECT_EQ(result.outcome, InitializationOutcome::kFalsePath);
  EXPECT_EQ(result.true_path_m, 0);
  EXPECT_EQ(Judge(RunOf(estimated), truth).outcome, InitializationOutcome::kUndecided)
      << "neither depth nor path is known";
}

TEST(FalseInitialization, DetectsAWrongScaleFromTheSceneDepth) {
  const auto truth = Sideways(0.3);
  const InitializationResult result = Judge(RunOf(truth), truth, Depths(5));
  EXPECT_EQ(result.outcome, InitializationOutcome::kFalsePath);
  EXPECT_NEAR(result.path_m, 5 * result.true_path_m, 1e-9) << "the path according to the map, in metres";
  EXPECT_NEAR(result.depth_m.value(), result.min_depth_m.value(), 1e-9);
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(0.2)).outcome, InitializationOutcome::kFalsePath)
      << "also for a nearer scene";
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(1)).outcome, InitializationOutcome::kRight);
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(1.05)).outcome, InitializationOutcome::kRight)
      << "within the tolerance of a tenth";
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(1.2)).outcome, InitializationOutcome::kFalsePath);
}

TEST(FalseInitialization, IsDetectedFromALowerBoundOfTheDepth) {
  const auto truth = Sideways(0.3);
  const RunRecord run = RunOf(truth);
  // The true depth is 6 m with an uncertainty that includes infinity, and the map's depth is 2 m.
  const double inverse = 1 / (3 * kSceneDepth_m);
  const InitializationResult result = Judge(run, truth, Depths(3, 0.8 * inverse));
  EXPECT_EQ(result.outcome, InitializationOutcome::kFalsePath);
  EXPECT_FALSE(result.max_depth_m);
  EXPECT_THAT(result.min_depth_m, ::testing::Optional(::testing::DoubleNear(2.5, 0.3)));
  // With this larger uncertainty, the same depths do not contradict the map.
  EXPECT_EQ(Judge(run, truth, Depths(3, 3 * inverse)).outcome, InitializationOutcome::kRight);
}

TEST(FalseInitialization, DetectsRandomDepths) {
  const auto truth = Sideways(0.3);
  const RunRecord run = RunOf(truth);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> factor(0.5, 2);
  const auto depths = [&](double sigma) {
    return [&, sigma](const InitializationRecord& start) {
      TrueDepths result = Depths(1, sigma)(start);
      for (auto& depth : result) depth->inverse *= factor(random);
      return result;
    };
  };
  FalseInitializationOptions lenient = Exact();
  lenient.truth_noise_m = 1;  // the path is not tested
  const InitializationResult result = Judge(run, truth, depths(0), lenient);
  EXPECT_EQ(result.outcome, InitializationOutcome::kFalseDepth);
  EXPECT_GT(result.depth_error, 0.1);
  EXPECT_FALSE(Judge(run, truth, depths(0.1), lenient).depth_error) << "too uncertain to decide";
}

TEST(FalseInitialization, RequiresEnoughDepths) {
  const auto truth = Sideways(0.3);
  const auto few = [](const InitializationRecord& start) {
    TrueDepths depths = Depths(5)(start);
    for (std::size_t i = 14; i < depths.size(); ++i) depths[i].reset();
    return depths;
  };
  const InitializationResult result = Judge(RunOf(truth), truth, few);
  EXPECT_EQ(result.depth_points, 14);
  EXPECT_EQ(result.outcome, InitializationOutcome::kRight) << "decided by its path";
  EXPECT_FALSE(result.min_depth_m);
}

TEST(FalseInitialization, IsNotCausedByNoiseInTheGroundTruth) {
  std::mt19937 random(3);
  FalseInitializationOptions options;
  options.truth_noise_m = 0.01;
  for (int trial = 0; trial < 50; ++trial) {
    auto truth = Sideways(0.1);
    const RunRecord run = RunOf(truth);
    std::normal_distribution<double> noise(0, 0.01);
    for (TimedPose& pose : truth) {
      Eigen::Vector3d& t = pose.truth_from_camera.translation;
      t += Eigen::Vector3d(noise(random), noise(random), noise(random));
    }
    const InitializationResult result = Judge(run, truth, {}, options);
    EXPECT_FALSE(IsFalse(result.outcome)) << ToString(result.outcome) << " " << result.error_m;
    EXPECT_GT(result.window_s, 1.05) << "a tenth of the path of one second does not exceed the noise";
  }
}

TEST(FalseInitialization, IsDetectedDespiteNoiseInTheGroundTruth) {
  std::mt19937 random(3);
  auto truth = Sideways(0.5);
  auto estimated = truth;
  for (TimedPose& pose : estimated)
    std::swap(pose.truth_from_camera.translation.x(), pose.truth_from_camera.translation.z());
  const RunRecord run = RunOf(estimated);
  std::normal_distribution<double> noise(0, 0.005);
  for (TimedPose& pose : truth) {
    Eigen::Vector3d& t = pose.truth_from_camera.translation;
    t += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  EXPECT_EQ(Judge(run, truth, {}, {}).outcome, InitializationOutcome::kFalsePath);
}

TEST(FalseInitialization, IsUndecidedWithTooLittleData) {
  const auto truth = Sideways(0.3);
  EXPECT_TRUE(ClassifyInitializations(RunOf(truth), {}, {}).empty()) << "without ground truth";
  RunRecord run = RunOf(truth);
  run.initializations[0].keyframes.clear();
  run.frames.resize(2);
  EXPECT_EQ(Judge(run, truth).outcome, InitializationOutcome::kUndecided);
  // The ground truth begins after the evaluated second.
  const std::vector<TimedPose> late(truth.begin() + kFirstDepth + 60, truth.end());
  EXPECT_EQ(Judge(RunOf(truth), late).outcome, InitializationOutcome::kUndecided);
}

TEST(FalseInitialization, IgnoresFramesOfOtherMapsAndLostFrames) {
  const auto truth = Sideways(0.3);
  RunRecord run = RunOf(truth);
  for (std::size_t i = 10; i < 20; ++i) {
    run.frames[i].map_key = 2;  // for a while the camera was in another map with its own coordinate frame
    run.frames[i].camera_from_map = engine::Rigid3(Rotation3(), {100, 0, 0});
  }
  for (std::size_t i = 20; i < 25; ++i) {
    run.frames[i].state = TrackingState::kLost;
    run.frames[i].camera_from_map = engine::Rigid3(Rotation3(), {100, 0, 0});
  }
  EXPECT_EQ(Judge(run, truth).outcome, InitializationOutcome::kRight);
}

TEST(FalseInitialization, ReportsWhetherTheEngineDiscardedTheMap) {
  const auto truth = Sideways(0);
  RunRecord run = RunOf(Sideways(0.1));
  EXPECT_FALSE(Judge(run, truth).discarded);
  run.maps[0].discarded = true;
  EXPECT_TRUE(Judge(run, truth).discarded);
}

TEST(FalseInitialization, RejectsInvalidOptions) {
  FalseInitializationOptions options;
  EXPECT_FALSE(options.Validate());
  options.truth_noise_m = -1;
  EXPECT_TRUE(options.Validate());
  const auto truth = Sideways(0.3);
  EXPECT_THROW(ClassifyInitializations(RunOf(truth), truth, {}, options), Error);
  options = {};
  options.tolerance = 0;
  EXPECT_TRUE(options.Validate());
  options = {};
  options.max_window = Timestamp(1);
  EXPECT_TRUE(options.Validate());
}

}  // namespace
}  // namespace docent::app
