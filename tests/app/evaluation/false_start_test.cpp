// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/false_start.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/base/error.h"
#include "engine/geometry/sim3.h"

namespace docent::app {
namespace {

using engine::Rotation3;
using engine::TrackingState;
using ::testing::Each;
using ::testing::Field;

constexpr int kFrames = 90;      // three seconds
constexpr int kFirstDepth = 15;  // the frame at which the map gets depth
constexpr double kSceneDepth_m = 2;

Timestamp TimeOf(int frame) {
  return Timestamp(frame * 33'333'333LL);
}

const engine::Sim3 kTruthFromMap = [] {
  engine::Sim3 transform;
  transform.rotation = Rotation3::Exp({0.5, -1, 0.2});
  transform.translation = {3, -4, 5};
  transform.scale = 2.5;
  return transform;
}();

// A camera that moves sideways at `speed_m` a second, with a bend, and turns a little.
std::vector<TimedPose> Sideways(double speed_m) {
  std::vector<TimedPose> poses;
  for (int i = 0; i < kFrames; ++i) {
    const double t = i / 30.0;
    poses.push_back({TimeOf(i),
                     {Rotation3::Exp({0.02 * t, 0.1 * t, 0}),
                      speed_m * Eigen::Vector3d(t, 0.1 * std::sin(3 * t), 0.05 * t * t)}});
  }
  return poses;
}

// What a map would say of this pose if it was right in its own frame and scale.
engine::Rigid3 InMap(const engine::Rigid3& truth_from_camera) {
  return engine::Rigid3(kTruthFromMap.rotation.inverse() * truth_from_camera.rotation,
                        kTruthFromMap.inverse() * truth_from_camera.translation)
      .inverse();
}

// A run whose map got depth from the keyframes 0 and kFirstDepth, of the camera poses that `told` has.
RunRecord RunOf(const std::vector<TimedPose>& told, double depth_m = kSceneDepth_m) {
  RunRecord run;
  for (int i = kFirstDepth; i < kFrames; ++i) {
    FrameRecord frame;
    frame.time = TimeOf(i);
    frame.state = TrackingState::kSixDof;
    frame.map_key = 1;
    frame.camera_from_map = InMap(told[static_cast<std::size_t>(i)].truth_from_camera);
    frame.median_depth = depth_m / kTruthFromMap.scale;
    run.frames.push_back(frame);
  }
  StartRecord start;
  start.map_key = 1;
  for (const int i : {0, kFirstDepth})
    start.keyframes.push_back({TimeOf(i), InMap(told[static_cast<std::size_t>(i)].truth_from_camera)});
  run.starts.push_back(start);
  MapRecord map;
  map.key = 1;
  run.maps.push_back(map);
  return run;
}

StartResult Judge(const RunRecord& run, const std::vector<TimedPose>& truth,
                  const FalseStartOptions& options = {}) {
  const std::vector<StartResult> results = JudgeStarts(run, truth, options);
  EXPECT_EQ(results.size(), 1u);
  return results.at(0);
}

TEST(FalseStart, IsNotFoundInARightStartOfAnyFrameAndScale) {
  const auto truth = Sideways(0.3);
  const StartResult result = Judge(RunOf(truth), truth);
  EXPECT_EQ(result.verdict, StartVerdict::kRight);
  EXPECT_NEAR(result.error_m, 0, 1e-9);
  EXPECT_NEAR(result.depth_m, kSceneDepth_m, 1e-6);
  EXPECT_NEAR(result.path_m, result.true_path_m, 1e-9);
  EXPECT_NEAR(result.window_s, 1, 0.04);
}

TEST(FalseStart, IsAMotionInADirectionThatTheCameraDidNotTake) {
  const auto truth = Sideways(0.3);
  auto told = truth;
  for (TimedPose& pose : told) {  // forwards instead of sideways, with the orientations as they were
    Eigen::Vector3d& t = pose.truth_from_camera.translation;
    t = {t.z(), t.y(), t.x()};
  }
  EXPECT_EQ(Judge(RunOf(told), truth).verdict, StartVerdict::kFalsePath);
}

TEST(FalseStart, IsAMotionBackwardsAlongTheTrueOne) {
  const auto truth = Sideways(0.3);
  auto told = truth;
  for (TimedPose& pose : told) pose.truth_from_camera.translation *= -1;
  const StartResult result = Judge(RunOf(told), truth);
  EXPECT_EQ(result.verdict, StartVerdict::kFalsePath);
  EXPECT_EQ(result.path_m, 0);
}

TEST(FalseStart, IsAScaleThatChangesWithinTheFirstSecond) {
  const auto truth = Sideways(0.3);
  auto told = truth;
  for (std::size_t i = kFirstDepth; i < told.size(); ++i) {
    const Eigen::Vector3d from = truth[kFirstDepth].truth_from_camera.translation;
    Eigen::Vector3d& t = told[i].truth_from_camera.translation;
    t = from + 0.2 * (t - from);  // the keyframes' baseline was five times too long
  }
  EXPECT_EQ(Judge(RunOf(told), truth).verdict, StartVerdict::kFalsePath);
}

TEST(FalseStart, IsAMapOfACameraThatOnlyTurned) {
  const auto truth = Sideways(0);
  const auto told = Sideways(0.1);
  const StartResult result = Judge(RunOf(told), truth);
  EXPECT_TRUE(IsFalse(result.verdict));
  EXPECT_EQ(result.true_path_m, 0);
}

TEST(FalseStart, IsADepthOfCentimetresThatALineOfMillimetresWouldNeed) {
  const auto truth = Sideways(0.004);
  const auto told = Sideways(0.1);  // the right shape, but 25 times as long before the same depth
  const StartResult result = Judge(RunOf(told), truth);
  EXPECT_EQ(result.verdict, StartVerdict::kFalseDepth);
  EXPECT_NEAR(result.depth_m, kSceneDepth_m * 0.04, 1e-6);
}

TEST(FalseStart, IsNotMadeByTheNoiseOfTheTruth) {
  std::mt19937 random(3);
  int right = 0;
  for (int trial = 0; trial < 50; ++trial) {
    auto truth = Sideways(0.1);
    const RunRecord run = RunOf(truth);
    std::normal_distribution<double> noise(0, 0.01);
    for (TimedPose& pose : truth) {
      Eigen::Vector3d& t = pose.truth_from_camera.translation;
      t += Eigen::Vector3d(noise(random), noise(random), noise(random));
    }
    EXPECT_NEAR(EstimateTruthNoise(truth, run.frames, {}), 0.01, 0.003);
    const StartResult result = Judge(run, truth);
    EXPECT_FALSE(IsFalse(result.verdict)) << ToString(result.verdict);
    EXPECT_GT(result.window_s, 1.5) << "a tenth of the path of one second is no more than the noise";
    right += result.verdict == StartVerdict::kRight;
  }
  EXPECT_GT(right, 40);
}

TEST(FalseStart, IsFoundThroughTheNoiseOfTheTruth) {
  std::mt19937 random(3);
  auto truth = Sideways(0.5);
  auto told = truth;
  for (TimedPose& pose : told)
    std::swap(pose.truth_from_camera.translation.x(), pose.truth_from_camera.translation.z());
  const RunRecord run = RunOf(told);
  std::normal_distribution<double> noise(0, 0.005);
  for (TimedPose& pose : truth) {
    Eigen::Vector3d& t = pose.truth_from_camera.translation;
    t += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  EXPECT_EQ(Judge(run, truth).verdict, StartVerdict::kFalsePath);
}

TEST(FalseStart, IsUndecidedWithTooLittleData) {
  const auto truth = Sideways(0.3);
  EXPECT_TRUE(JudgeStarts(RunOf(truth), {}).empty()) << "without a truth";
  RunRecord run = RunOf(truth);
  run.starts[0].keyframes.clear();
  run.frames.resize(2);
  EXPECT_EQ(Judge(run, truth).verdict, StartVerdict::kUndecided);
  // The truth begins when the second is over.
  const std::vector<TimedPose> late(truth.begin() + kFirstDepth + 60, truth.end());
  EXPECT_EQ(Judge(RunOf(truth), late).verdict, StartVerdict::kUndecided);
}

TEST(FalseStart, LooksAtTheMapsOwnFramesAlone) {
  const auto truth = Sideways(0.3);
  RunRecord run = RunOf(truth);
  for (std::size_t i = 10; i < 20; ++i) {
    run.frames[i].map_key = 2;  // for a while the camera was in another map, in a frame of its own
    run.frames[i].camera_from_map = engine::Rigid3(Rotation3(), {100, 0, 0});
  }
  for (std::size_t i = 20; i < 25; ++i) {
    run.frames[i].state = TrackingState::kLost;
    run.frames[i].camera_from_map = engine::Rigid3(Rotation3(), {100, 0, 0});
  }
  EXPECT_EQ(Judge(run, truth).verdict, StartVerdict::kRight);
}

TEST(FalseStart, IsToldApartWhenTheEngineNoticedIt) {
  const auto truth = Sideways(0);
  RunRecord run = RunOf(Sideways(0.1));
  run.maps[0].discarded = true;
  EXPECT_TRUE(Judge(run, truth).discarded);
}

TEST(FalseStart, RefusesOptionsThatMakeNoSense) {
  FalseStartOptions options;
  EXPECT_FALSE(options.Validate());
  options.truth_noise_m = -1;
  EXPECT_TRUE(options.Validate());
  const auto truth = Sideways(0.3);
  EXPECT_THROW(JudgeStarts(RunOf(truth), truth, options), Error);
  options = {};
  options.tolerance = 0;
  EXPECT_TRUE(options.Validate());
  options = {};
  options.longest = Timestamp(1);
  EXPECT_TRUE(options.Validate());
}

}  // namespace
}  // namespace docent::app
