// SPDX-License-Identifier: Apache-2.0
// A simulated museum whose bays are mapped by the real program, with what is true about it.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/evaluation/mean_rotation.h"
#include "app/evaluation/simulated_truth.h"
#include "app/simulator/simulation.h"
#include "engine/geometry/sim3.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {

inline std::string BayName(int bay) {
  return "Bay " + std::to_string(bay);
}

// A simulated museum with what is true about it.
class TrueMuseum {
 public:
  explicit TrueMuseum(const std::string& spec)
      : simulation_(MakeSimulation(spec)), segments_(SegmentsOf(*simulation_)) {
    for (int i = 0; i < simulation_->frame_count(); ++i) frames_[simulation_->time(i)] = i;
  }

  // When a part of the trajectory ("build3") begins and ends, in seconds from the first image.
  double Begin(const std::string& label) const { return Seconds(Segment(label)->time); }
  double End(const std::string& label) const {
    const auto next = Segment(label) + 1;
    return Seconds(next == segments_.end() ? frames_.rbegin()->first : next->time);
  }
  // The pose of the camera in metres when an image was taken.
  engine::Rigid3 CameraAt(Timestamp time) const { return simulation_->world_from_camera(frames_.at(time)); }
  // Where the camera was when the map of a bay was begun.
  Eigen::Vector3d BeginOf(int bay) const {
    return CameraAt(Segment("build" + std::to_string(bay))->time).translation;
  }
  // A point at the front of a bay, which the camera sees there.
  Eigen::Vector3d FrontOf(int bay) const {
    return simulation_->places()[static_cast<std::size_t>(bay)].anchor_in_world;
  }

 private:
  std::vector<TimedLabel>::const_iterator Segment(const std::string& label) const {
    const auto found = std::find_if(segments_.begin(), segments_.end(),
                                    [&](const TimedLabel& segment) { return segment.label == label; });
    EXPECT_TRUE(found != segments_.end()) << label;
    return found;
  }
  double Seconds(Timestamp time) const { return ToSeconds(time - frames_.begin()->first); }

  const std::unique_ptr<Simulation> simulation_;
  const std::vector<TimedLabel> segments_;
  std::map<Timestamp, int> frames_;
};

inline double NumberIn(const Row& row, const char* column) {
  return ParseNumber(row.at(column)).value_or(std::nan(""));
}

inline Eigen::Vector3d VectorIn(const Row& row, const char* x, const char* y, const char* z) {
  return {NumberIn(row, x), NumberIn(row, y), NumberIn(row, z)};
}

// The similarity that takes a map to the museum, in metres, from the poses of the later half of the images
// that made it: the mean of their rotations, and the scale and place that fit best with it. The earlier ones
// have the poses of a map that was still being adjusted.
inline engine::Sim3 WorldFromMap(const TrueMuseum& museum, const std::vector<Row>& frames,
                                 const std::string& map) {
  std::vector<engine::Rotation3> rotations;
  std::vector<Eigen::Vector3d> in_map, in_world;
  std::vector<const Row*> of_map;
  for (const Row& row : frames) {
    if (row.at("map") == map && (row.at("state") == "sixdof" || row.at("state") == "hybrid"))
      of_map.push_back(&row);
  }
  for (std::size_t i = of_map.size() / 2; i < of_map.size(); ++i) {
    const Row& row = *of_map[i];
    const engine::Rigid3 truth = museum.CameraAt(*ParseSeconds(row.at("timestamp")));
    const Eigen::Quaterniond map_from_camera(NumberIn(row, "qw"), NumberIn(row, "qx"), NumberIn(row, "qy"),
                                             NumberIn(row, "qz"));
    rotations.push_back(truth.rotation * engine::Rotation3(map_from_camera).inverse());
    in_map.push_back(VectorIn(row, "tx", "ty", "tz"));
    in_world.push_back(truth.translation);
  }
  EXPECT_GT(rotations.size(), 10u) << map;
  if (rotations.empty()) return {};
  engine::Sim3 world_from_map;
  world_from_map.rotation = MeanRotation(rotations);
  Eigen::Vector3d middle_in_map = Eigen::Vector3d::Zero(), middle_in_world = middle_in_map;
  const auto count = static_cast<double>(in_map.size());
  for (std::size_t i = 0; i < in_map.size(); ++i) {
    middle_in_map += in_map[i] / count;
    middle_in_world += in_world[i] / count;
  }
  double product = 0, square = 0;
  for (std::size_t i = 0; i < in_map.size(); ++i) {
    const Eigen::Vector3d turned = world_from_map.rotation * (in_map[i] - middle_in_map);
    product += turned.dot(in_world[i] - middle_in_world);
    square += turned.squaredNorm();
  }
  world_from_map.scale = product / square;
  world_from_map.translation =
      middle_in_world - world_from_map.scale * (world_from_map.rotation * middle_in_map);
  return world_from_map;
}

inline void AppendNumbers(const Eigen::Vector3d& numbers, std::vector<std::string>* arguments) {
  for (const double number : numbers) arguments->push_back(FormatExactly(number));
}

// The library of a museum whose bays have been mapped, one map for each.
class MappedMuseum {
 public:
  explicit MappedMuseum(const std::string& spec) : spec_(spec), museum_(spec) {}

  // Maps these bays, in the order in which the camera comes to them.
  void Map(const std::vector<int>& bays) {
    std::string script;
    for (const int bay : bays) {
      const std::string label = "build" + std::to_string(bay);
      script += FormatNumber(museum_.Begin(label)) + " map new \"" + BayName(bay) + "\"\n";
      if (bay != bays.back()) script += FormatNumber(museum_.End(label)) + " map stop\n";
    }
    Author(script, museum_.End("build" + std::to_string(bays.back())));
    const std::vector<Row> frames = ReadFrames(folder_ / "author/frames.csv");
    for (const int bay : bays) world_from_map_[bay] = WorldFromMap(museum_, frames, BayName(bay));
  }
  // Runs the author's program on the begin of the trajectory.
  void Author(const std::string& script, double until) {
    folder_.Write("script.txt", script);
    Succeed({"author", "--library", library(), "--camera", "sim:" + spec_, "--until", FormatNumber(until),
             "--pace", "lockstep", "--headless", "--script", (folder_ / "script.txt").string(), "--output",
             (folder_ / "author").string()});
  }
  // Runs the program, which must succeed, and returns its output.
  std::string Succeed(const std::vector<std::string>& arguments) const {
    const Outcome outcome = RunDocent(arguments);
    EXPECT_EQ(outcome.exit_status, 0) << testing::PrintToString(arguments) << outcome.errors;
    return outcome.output;
  }
  // Adds a signpost at a place in the museum, which points to where the map of another bay begins.
  void AddSign(int bay, int to, const Eigen::Vector3d& place) {
    const engine::Sim3& world_from_map = world_from_map_.at(bay);
    std::vector<std::string> arguments = {
        "content",   "add",       "--signpost", "To " + BayName(to),
        "--to",      BayName(to), "--map",      BayName(bay),
        "--library", library(),   "--height",   FormatNumber(0.15 / world_from_map.scale),
        "--at"};
    AppendNumbers(world_from_map.inverse() * place, &arguments);
    arguments.emplace_back("--direction");
    AppendNumbers(world_from_map.rotation.inverse() * (museum_.BeginOf(to) - place), &arguments);
    Succeed(arguments);
    signs_[{bay, to}] = place;
  }
  // The place in the museum of the foot of the signpost that leads from a bay to another.
  Eigen::Vector3d PlaceOfSign(int bay, int to) const { return signs_.at({bay, to}); }

  const TrueMuseum& museum() const { return museum_; }
  const std::string& spec() const { return spec_; }
  std::string library() const { return (folder_ / "museum.docent").string(); }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  const std::string spec_;
  const TrueMuseum museum_;
  const TemporaryFolder folder_;
  std::map<int, engine::Sim3> world_from_map_;
  std::map<std::pair<int, int>, Eigen::Vector3d> signs_;
};

}  // namespace docent::app
