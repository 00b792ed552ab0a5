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
  for (int i = 0; i < 20; ++i)
    start.points.push_back({Eigen::Vector2f::Zero(), run.frames[0].median_depth * (0.5 + 0.05 * i)});
  for (const int i : {0, kFirstDepth})
    start.keyframes.push_back({TimeOf(i), InMap(told[static_cast<std::size_t>(i)].truth_from_camera)});
  run.starts.push_back(start);
  MapRecord map;
  map.key = 1;
  run.maps.push_back(map);
  return run;
}

// The options for a truth without noise.
FalseStartOptions Exact() {
  FalseStartOptions options;
  options.truth_noise_m = 0;
  return options;
}

StartResult Judge(const RunRecord& run, const std::vector<TimedPose>& truth,
                  const TrueDepthSource& true_depths = {}, const FalseStartOptions& options = Exact()) {
  const std::vector<StartResult> results = JudgeStarts(run, truth, true_depths, options);
  EXPECT_EQ(results.size(), 1u);
  return results.at(0);
}

// The told depths of a map of the right scale are the true ones divided by `factor`.
TrueDepthSource Depths(double factor, double sigma = 0) {
  return [=](const StartRecord& start) {
    TrueDepths depths;
    for (const StartRecord::Point& point : start.points)
      depths.push_back(TrueDepth{1 / (factor * kTruthFromMap.scale * point.depth), sigma});
    return depths;
  };
}

TEST(FalseStart, IsNotFoundInARightStartOfAnyFrameAndScale) {
  const auto truth = Sideways(0.3);
  const StartResult result = Judge(RunOf(truth), truth);
  EXPECT_EQ(result.verdict, StartVerdict::kRight);
  EXPECT_NEAR(result.error_m, 0, 1e-9);
  EXPECT_THAT(result.depth_m, ::testing::Optional(::testing::DoubleNear(kSceneDepth_m, 1e-6)));
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
  const StartResult result = Judge(RunOf(told), truth, Depths(1));
  EXPECT_EQ(result.verdict, StartVerdict::kFalsePath);
  EXPECT_EQ(result.true_path_m, 0);
  EXPECT_EQ(Judge(RunOf(told), truth).verdict, StartVerdict::kUndecided) << "no depth and no path to go by";
}

TEST(FalseStart, IsARightPathBeforeASceneThatIsFartherAway) {
  const auto truth = Sideways(0.3);
  const StartResult result = Judge(RunOf(truth), truth, Depths(5));
  EXPECT_EQ(result.verdict, StartVerdict::kFalsePath);
  EXPECT_NEAR(result.path_m, 5 * result.true_path_m, 1e-9) << "what the map claims, in metres";
  EXPECT_NEAR(result.depth_m.value(), result.least_depth_m.value(), 1e-9);
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(0.2)).verdict, StartVerdict::kFalsePath) << "or nearer";
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(1)).verdict, StartVerdict::kRight);
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(1.05)).verdict, StartVerdict::kRight) << "within a tenth";
  EXPECT_EQ(Judge(RunOf(truth), truth, Depths(1.2)).verdict, StartVerdict::kFalsePath);
}

TEST(FalseStart, IsFoundWhereTheTruthOnlySaysThatTheSceneIsFar) {
  const auto truth = Sideways(0.3);
  const RunRecord run = RunOf(truth);
  // The scene is 6 m away, give or take so much that it might be at infinity, where the map has 2 m.
  const double inverse = 1 / (3 * kSceneDepth_m);
  const StartResult result = Judge(run, truth, Depths(3, 0.8 * inverse));
  EXPECT_EQ(result.verdict, StartVerdict::kFalsePath);
  EXPECT_FALSE(result.most_depth_m);
  EXPECT_THAT(result.least_depth_m, ::testing::Optional(::testing::DoubleNear(2.5, 0.3)));
  // And here the same depths say next to nothing.
  EXPECT_EQ(Judge(run, truth, Depths(3, 3 * inverse)).verdict, StartVerdict::kRight);
}

TEST(FalseStart, IsAMapOfRandomDepths) {
  const auto truth = Sideways(0.3);
  const RunRecord run = RunOf(truth);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> factor(0.5, 2);
  const auto depths = [&](double sigma) {
    return [&, sigma](const StartRecord& start) {
      TrueDepths result = Depths(1, sigma)(start);
      for (auto& depth : result) depth->inverse *= factor(random);
      return result;
    };
  };
  FalseStartOptions lenient = Exact();
  lenient.truth_noise_m = 1;  // the path may be anything
  const StartResult result = Judge(run, truth, depths(0), lenient);
  EXPECT_EQ(result.verdict, StartVerdict::kFalseDepth);
  EXPECT_GT(result.depth_error, 0.1);
  EXPECT_FALSE(Judge(run, truth, depths(0.1), lenient).depth_error) << "known too badly to tell";
}

TEST(FalseStart, AsksForEnoughDepths) {
  const auto truth = Sideways(0.3);
  const auto few = [](const StartRecord& start) {
    TrueDepths depths = Depths(5)(start);
    for (std::size_t i = 14; i < depths.size(); ++i) depths[i].reset();
    return depths;
  };
  const StartResult result = Judge(RunOf(truth), truth, few);
  EXPECT_EQ(result.depth_points, 14);
  EXPECT_EQ(result.verdict, StartVerdict::kRight) << "by its path";
  EXPECT_FALSE(result.least_depth_m);
}

TEST(FalseStart, IsNotMadeByTheNoiseOfTheTruth) {
  std::mt19937 random(3);
  FalseStartOptions options;
  options.truth_noise_m = 0.01;
  for (int trial = 0; trial < 50; ++trial) {
    auto truth = Sideways(0.1);
    const RunRecord run = RunOf(truth);
    std::normal_distribution<double> noise(0, 0.01);
    for (TimedPose& pose : truth) {
      Eigen::Vector3d& t = pose.truth_from_camera.translation;
      t += Eigen::Vector3d(noise(random), noise(random), noise(random));
    }
    const StartResult result = Judge(run, truth, {}, options);
    EXPECT_FALSE(IsFalse(result.verdict)) << ToString(result.verdict) << " " << result.error_m;
    EXPECT_GT(result.window_s, 1.05) << "a tenth of the path of one second is no more than the noise";
  }
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
  EXPECT_EQ(Judge(run, truth, {}, {}).verdict, StartVerdict::kFalsePath);
}

TEST(FalseStart, IsUndecidedWithTooLittleData) {
  const auto truth = Sideways(0.3);
  EXPECT_TRUE(JudgeStarts(RunOf(truth), {}, {}).empty()) << "without a truth";
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
  EXPECT_FALSE(Judge(run, truth).discarded);
  run.maps[0].discarded = true;
  EXPECT_TRUE(Judge(run, truth).discarded);
}

TEST(FalseStart, RefusesOptionsThatMakeNoSense) {
  FalseStartOptions options;
  EXPECT_FALSE(options.Validate());
  options.truth_noise_m = -1;
  EXPECT_TRUE(options.Validate());
  const auto truth = Sideways(0.3);
  EXPECT_THROW(JudgeStarts(RunOf(truth), truth, {}, options), Error);
  options = {};
  options.tolerance = 0;
  EXPECT_TRUE(options.Validate());
  options = {};
  options.longest = Timestamp(1);
  EXPECT_TRUE(options.Validate());
}

}  // namespace
}  // namespace docent::app
