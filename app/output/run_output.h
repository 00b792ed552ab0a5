// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "app/files/checked_file.h"
#include "engine/base/time.h"
#include "engine/tracking/tracked_frame.h"

// The files of a run in `--output DIR`: trajectory.txt, frames.csv and events.csv, in the formats of
// docs/output-files.md. Poses are written as camera in map: position in map units, quaternion x y z w.
namespace docent::app {

// Something that happened besides a frame: a keyframe, a map switch, a command, a save, a warning.
struct Event {
  Timestamp time{};
  std::string event;   // one word, such as "keyframe", "map", "command", "save", "warning"
  std::string detail;  // human-readable
};

// The columns of frames.csv, without the line break. `map_name` is empty when there is none.
std::string FormatFrameLine(const engine::TrackedFrame& frame, std::string_view map_name);
// `timestamp tx ty tz qx qy qz qw`; only for frames with a pose.
std::string FormatTrajectoryLine(const engine::TrackedFrame& frame);
std::string FormatEventLine(const Event& event);
// A CSV field, quoted where RFC 4180 requires it.
std::string CsvField(std::string_view text);

// Owns the three files while the session runs. One thread. Throws Error when a file cannot be written.
class RunOutput {
 public:
  // Creates the folder. Files of an earlier run are replaced when Close is called.
  explicit RunOutput(const std::filesystem::path& folder);

  // trajectory.txt is that of camera 0; further cameras are written to trajectory_1.txt and so on.
  void Add(const engine::TrackedFrame& frame, std::string_view map_name);
  // Events may come from several threads out of order; Close sorts them by time, and those of one time stay
  // in the order in which they were added.
  void Add(const Event& event);
  // Completes the files and gives them their final names. Must also be called when a run ends with an error,
  // so that everything before the error can be read.
  void Close();

 private:
  // The place of an event in events.csv.
  struct EventLine {
    Timestamp time{};
    std::size_t begin = 0, size = 0;  // in bytes
  };

  CheckedFile& Trajectory(int camera);
  void WriteToEvents(std::string_view text);
  void SortEvents() const;

  std::filesystem::path folder_;
  std::vector<EventLine> event_lines_;
  std::size_t events_size_ = 0;  // bytes written so far
  CheckedFile frames_, events_;
  std::map<int, CheckedFile> trajectories_;
};

}  // namespace docent::app
