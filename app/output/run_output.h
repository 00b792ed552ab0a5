// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "app/files/checked_file.h"
#include "engine/base/time.h"
#include "engine/tracking/tracked_frame.h"

// What a run leaves in `--output DIR`: trajectory.txt, frames.csv and events.csv, in the formats that
// command-line.md fixes. Poses are written as camera in map: position in metres, quaternion x y z w.
namespace docent::app {

// Something that happened besides a frame: a keyframe, a map switch, a command, a save, a warning.
struct Event {
  Timestamp time{};
  std::string event;   // one word: "keyframe", "map", "command", "save", "warning"
  std::string detail;  // for people
};

// The columns of frames.csv, without the line's end. `map_name` is empty when there is none.
std::string FormatFrameLine(const engine::TrackedFrame& frame, std::string_view map_name);
// `timestamp tx ty tz qx qy qz qw`; only for frames with a pose.
std::string FormatTrajectoryLine(const engine::TrackedFrame& frame);
std::string FormatEventLine(const Event& event);
// A CSV field, in quotes where RFC 4180 asks for them.
std::string CsvField(std::string_view text);

// Owns the three files while the session runs. One thread. Throws Error where a file cannot be written.
class RunOutput {
 public:
  // Makes the folder; files of an earlier run are replaced when Close is called.
  explicit RunOutput(const std::filesystem::path& folder);

  // trajectory.txt holds camera 0; further cameras go to trajectory_1.txt and so on.
  void Add(const engine::TrackedFrame& frame, std::string_view map_name);
  void Add(const Event& event);
  // Makes the files complete and gives them their names. Call it also when a run ends by an error, so that
  // what came before the error can be read.
  void Close();

 private:
  CheckedFile& Trajectory(int camera);

  std::filesystem::path folder_;
  CheckedFile frames_, events_;
  std::map<int, CheckedFile> trajectories_;
};

}  // namespace docent::app
