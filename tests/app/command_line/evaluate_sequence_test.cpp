// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/evaluate_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "app/evaluation/true_depth.h"
#include "app/simulator/write_sequence.h"
#include "engine/base/median.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using testing::ElementsAre;

TEST(FirstFrames, KeepsWindowsWithinTheSequence) {
  EXPECT_THAT(FirstFrames(5, 100, 20), ElementsAre(0, 20, 40, 60, 80));
  EXPECT_THAT(FirstFrames(3, 100, 99), ElementsAre(0, 33, 66))
      << "the windows do not fit with distinct first frames";
  EXPECT_THAT(FirstFrames(2, 100, 99), ElementsAre(0, 1));
}

TEST(FirstFrames, SpreadsUnlimitedWindowsOverTheWholeSequence) {
  EXPECT_THAT(FirstFrames(4, 100, 0), ElementsAre(0, 25, 50, 75));
  EXPECT_THAT(FirstFrames(1, 100, 20), ElementsAre(0));
  EXPECT_THAT(FirstFrames(4, 100, 200), ElementsAre(0, 25, 50, 75))
      << "the window is longer than the sequence";
}

TEST(RecordOfMap, NamesTheMapThatAMapWasJoinedInto) {
  std::vector<Session::MapState> maps(3);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    maps[i].key = i + 1;
    maps[i].snapshot = std::make_shared<const engine::MapSnapshot>();
  }
  maps[0].name = "Hall";
  maps[1].name = "Hall 2";
  maps[1].joined_into = 1;
  maps[2].name = "Hall 3";
  maps[2].discarded = true;
  EXPECT_EQ(RecordOfMap(maps[0], maps).joined_into, "");
  EXPECT_EQ(RecordOfMap(maps[1], maps).joined_into, "Hall");
  EXPECT_FALSE(RecordOfMap(maps[1], maps).discarded);
  EXPECT_TRUE(RecordOfMap(maps[2], maps).discarded);
}

// The record of a run that tracks the simulation perfectly and whose map has depth from a frame on.
RunRecord RunInTruth(const Simulation& simulation, std::size_t first_depth) {
  RunRecord run;
  InitializationRecord start;
  start.map_key = 1;
  start.frame = first_depth;
  std::vector<Eigen::Vector2f> pixels;
  for (int x = 1; x < 14; ++x) {
    for (int y = 1; y < 10; ++y)
      pixels.emplace_back(simulation.camera().width_px() * x / 14.0F,
                          simulation.camera().height_px() * y / 10.0F);
  }
  const TrueDepths depths = SimulatedTrueDepths(simulation, static_cast<int>(first_depth), pixels);
  std::vector<double> known;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!depths[i]) continue;
    known.push_back(1 / depths[i]->inverse);
    start.points.push_back({pixels[i], known.back()});
  }
  for (int i = 0; i < simulation.frame_count(); ++i) {
    FrameRecord frame;
    frame.time = simulation.time(i);
    frame.state = engine::TrackingState::kSixDof;
    frame.map_key = 1;
    frame.camera_from_map = simulation.world_from_camera(i).inverse();
    frame.median_depth = Median(known);
    run.frames.push_back(frame);
  }
  run.initializations.push_back(std::move(start));
  return run;
}

TEST(ClassifyInitializationsOf, MeasuresTrueDepthsWithTheEstimateOfAnUnknownLens) {
  SimulationOptions world;
  world.field_of_view_deg = 90;  // The guess is 60.
  world.duration_s = 1.5;
  const auto simulation = MakeSimulation("room", world);
  const TemporaryFolder folder;
  WriteSequence(*simulation, folder / "walk");
  EvaluateOptions options;
  options.sequences = {(folder / "walk").string()};
  options.calibrations = {kEstimateCalibration};
  options.truth_noise_m = 0.001;
  RunRecord run = RunInTruth(*simulation, 5);
  run.lens_model = std::make_shared<const engine::CameraModel>(simulation->camera());
  const auto results = ClassifyInitializationsOf(options, DescribeSequence(options, 0), RunKey(), run);
  ASSERT_TRUE(results);
  ASSERT_EQ(results->size(), 1u);
  const InitializationResult& result = results->front();
  EXPECT_GE(result.depth_points, 15) << "too few pixels move as their lens says";
  ASSERT_TRUE(result.depth_m);
  EXPECT_NEAR(*result.depth_m / run.frames[5].median_depth, 1, 0.1);
}

}  // namespace
}  // namespace docent::app
