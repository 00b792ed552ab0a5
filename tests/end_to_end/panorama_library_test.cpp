// SPDX-License-Identifier: Apache-2.0
// Tests of the real program with a purely rotating camera: panorama maps are saved, and the camera
// relocalizes in them.
#include <gmock/gmock.h>

#include <algorithm>
#include <numbers>
#include <string>
#include <vector>

#include "app/evaluation/simulated_truth.h"
#include "app/simulator/simulation.h"
#include "engine/geometry/sim3.h"
#include "maps/library/library.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct LivePose {
  Timestamp time;
  std::string state;
  engine::Rigid3 map_from_camera;
};

std::vector<LivePose> ReadPoses(const std::filesystem::path& path) {
  std::vector<LivePose> poses;
  for (const Row& row : ReadFrames(path)) {
    if (row.at("tx").empty()) continue;
    const auto number = [&](const char* column) { return *ParseNumber(row.at(column)); };
    poses.push_back({*ParseSeconds(row.at("timestamp")), row.at("state"),
                     engine::Rigid3(engine::Rotation3(Eigen::Quaterniond(number("qw"), number("qx"),
                                                                         number("qy"), number("qz"))),
                                    {number("tx"), number("ty"), number("tz")})});
  }
  return poses;
}

// The camera moves around the table, then rotates away from it by 120 degrees without translation, and back.
TEST(PanoramaLibrary, RelocalizesInASavedMapWithInfinitePointsOnly) {
  const TemporaryFolder folder;
  const auto simulation = MakeSimulation("room:1");
  const auto truth = GroundTruthOf(*simulation);
  const auto labels = SegmentsOf(*simulation);
  const auto turn = std::find_if(labels.begin(), labels.end(),
                                 [](const TimedLabel& label) { return label.label == "rotation"; });
  ASSERT_NE(turn, labels.end());
  const double begin = ToSeconds(turn->time), end = ToSeconds((turn + 1)->time);
  const std::string file = (folder / "room.docent").string();
  folder.Write("script.txt", "4 map new \"Room\"\n");
  const Outcome authored = RunDocent({"author", "--library", file, "--camera", "sim:room:1", "--from", "4",
                                      "--until", FormatSeconds(FromSeconds(end + 0.5)), "--headless",
                                      "--script", (folder / "script.txt").string(), "--output",
                                      (folder / "author").string(), "--pace", "lockstep"});
  ASSERT_EQ(authored.exit_status, 0) << authored.errors;

  const Outcome verified = RunDocent({"maps", "verify", "--library", file});
  EXPECT_EQ(verified.exit_status, 0) << verified.errors;
  EXPECT_THAT(verified.output, HasSubstr("no problems found"));
  {
    const maps::Library library = maps::Library::Open(folder / "room.docent", maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    const auto map = library.Load(library.FindByName("Room").key).snapshot;
    EXPECT_GE(map->panoramas.size(), 2u);
    EXPECT_TRUE(std::any_of(map->keyframes.begin(), map->keyframes.end(), [](const engine::KeyFrame& k) {
      return k.kind == engine::KeyFrameKind::kPanorama;
    }));
  }

  // The similarity between map and room is estimated from the walk around the table. Its rotation comes from
  // the last orientation, because a nearly straight path does not constrain the rotation about itself.
  engine::Rotation3 truth_from_map_rotation;
  std::vector<Eigen::Vector3d> in_truth, in_map;
  for (const LivePose& pose : ReadPoses(folder / "author" / "frames.csv")) {
    if (pose.state != "sixdof" || ToSeconds(pose.time) > begin) continue;
    const TimedPose* true_pose = FindPose(truth, pose.time, std::chrono::milliseconds(1));
    ASSERT_NE(true_pose, nullptr);
    in_truth.push_back(true_pose->truth_from_camera.translation);
    in_map.push_back(pose.map_from_camera.translation);
    truth_from_map_rotation = true_pose->truth_from_camera.rotation * pose.map_from_camera.rotation.inverse();
  }
  const auto truth_from_map = engine::AlignSim3(in_truth, in_map);
  ASSERT_TRUE(truth_from_map);

  // A visitor who starts in the middle of the rotation, facing away from the table, sees infinite points
  // only.
  const double middle = (begin + end) / 2;
  const std::string before = ReadAll(folder / "room.docent");
  const Outcome toured = RunDocent({"tour", "--library", file, "--camera", "sim:room:1", "--from",
                                    FormatSeconds(FromSeconds(middle - 0.3)), "--until",
                                    FormatSeconds(FromSeconds(middle + 0.5)), "--headless", "--output",
                                    (folder / "tour").string(), "--pace", "lockstep"});
  ASSERT_EQ(toured.exit_status, 0) << toured.errors;
  EXPECT_EQ(before, ReadAll(folder / "room.docent"));
  const auto frames = ReadFrames(folder / "tour" / "frames.csv").size();
  const auto poses = ReadPoses(folder / "tour" / "frames.csv");
  ASSERT_GT(frames, 20u);
  ASSERT_GT(poses.size(), frames * 3 / 4);
  EXPECT_EQ(poses.front().state, "relocalized");
  EXPECT_TRUE(std::any_of(poses.begin(), poses.end(), [](const auto& p) { return p.state == "panorama"; }));
  for (const LivePose& pose : poses) {
    const TimedPose* true_pose = FindPose(truth, pose.time, std::chrono::milliseconds(1));
    ASSERT_NE(true_pose, nullptr);
    const engine::Rotation3 rotation = truth_from_map_rotation * pose.map_from_camera.rotation;
    const double error_rad = (true_pose->truth_from_camera.rotation.inverse() * rotation).Angle();
    EXPECT_LT(error_rad * 180 / std::numbers::pi, 2.0) << ToSeconds(pose.time);
    // The position must be that of the panorama map.
    const Eigen::Vector3d place = *truth_from_map * pose.map_from_camera.translation;
    EXPECT_LT((place - true_pose->truth_from_camera.translation).norm(), 0.05) << ToSeconds(pose.time);
  }
}

}  // namespace
}  // namespace docent::app
