// SPDX-License-Identifier: Apache-2.0
#include "app/output/run_output.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

// A camera at (1, 2, 3) in the map that looks along the map's x axis: rotated by 90 degrees about y.
engine::TrackedFrame MakeFrame(engine::TrackingState state) {
  engine::TrackedFrame frame;
  frame.frame.time = std::chrono::milliseconds(12500);
  frame.state = state;
  const engine::Rigid3 map_from_camera(engine::Rotation3::Exp({0, std::numbers::pi / 2, 0}), {1, 2, 3});
  frame.camera_from_map = map_from_camera.inverse();
  frame.finite_points = 120;
  frame.infinite_points = 7;
  frame.quality = 0.75;
  frame.tracking_time = std::chrono::microseconds(3250);
  return frame;
}

TEST(FramesFile, ContainsThePoseOfTheCameraInTheMap) {
  EXPECT_EQ(FormatFrameLine(MakeFrame(engine::TrackingState::kHybrid), "Desk 3"),
            "12.500000000,0,hybrid,Desk 3,120,7,0.75,3.25,1,2,3,0,0.707106781,0,0.707106781");
}

TEST(FramesFile, LeavesMissingPosesEmpty) {
  EXPECT_EQ(FormatFrameLine(MakeFrame(engine::TrackingState::kLost), ""),
            "12.500000000,0,lost,,120,7,0.75,3.25,,,,,,,");
}

TEST(CsvFields, AreQuotedWhereNecessary) {
  EXPECT_EQ(CsvField("Desk 3"), "Desk 3");
  EXPECT_EQ(CsvField("a,b"), "\"a,b\"");
  EXPECT_EQ(CsvField("say \"x\"\n"), "\"say \"\"x\"\"\n\"");
}

TEST(RunOutput, WritesItsThreeFiles) {
  const TemporaryFolder folder;
  {
    RunOutput output(folder / "deep/run");
    output.Add(MakeFrame(engine::TrackingState::kInitializing), "");
    output.Add(MakeFrame(engine::TrackingState::kSixDof), "Desk");
    engine::TrackedFrame second = MakeFrame(engine::TrackingState::kRelocalized);
    second.frame.camera = 1;
    output.Add(second, "Desk");
    output.Add(Event{std::chrono::seconds(1), "warning", "slow, very"});
    output.Close();
  }
  const std::string frames = ReadAll(folder / "deep/run/frames.csv");
  EXPECT_EQ(frames.substr(0, frames.find('\n')),
            "timestamp,camera,state,map,finite,infinite,quality,tracking_ms,tx,ty,tz,qx,qy,qz,qw");
  EXPECT_EQ(std::count(frames.begin(), frames.end(), '\n'), 4);
  EXPECT_EQ(ReadAll(folder / "deep/run/trajectory.txt"), "12.500000000 1 2 3 0 0.707106781 0 0.707106781\n");
  EXPECT_EQ(ReadAll(folder / "deep/run/trajectory_1.txt"),
            "12.500000000 1 2 3 0 0.707106781 0 0.707106781\n");
  EXPECT_EQ(ReadAll(folder / "deep/run/events.csv"),
            "timestamp,event,detail\n1.000000000,warning,\"slow, very\"\n");
}

TEST(RunOutput, WritesEventsInTheOrderOfTheirTimes) {
  const TemporaryFolder folder;
  RunOutput output(folder.path());
  output.Add(Event{std::chrono::seconds(2), "map", "second,\nof two lines"});
  output.Add(Event{std::chrono::seconds(1), "camera", "first"});
  output.Add(Event{std::chrono::seconds(2), "save", "third"});
  output.Add(Event{std::chrono::milliseconds(1500), "rig", "between"});
  output.Close();
  EXPECT_EQ(ReadAll(folder / "events.csv"),
            "timestamp,event,detail\n1.000000000,camera,first\n1.500000000,rig,between\n"
            "2.000000000,map,\"second,\nof two lines\"\n2.000000000,save,third\n");
}

TEST(RunOutput, WritesEachEventWhenItHappens) {
  const TemporaryFolder folder;
  RunOutput output(folder / "out");
  output.Add(Event{std::chrono::seconds(1), "map", "entered Hall"});
  EXPECT_NE(ReadAll(folder / "out/events.csv.part").find("1.000000000,map,entered Hall\n"),
            std::string::npos);
}

TEST(RunOutput, ReportsAFolderThatCannotBeCreated) {
  const TemporaryFolder folder;
  folder.Write("file", "");
  EXPECT_NE(ErrorOf([&] { RunOutput output(folder / "file/run"); }).find("Cannot create the folder"),
            std::string::npos);
}

}  // namespace
}  // namespace docent::app
