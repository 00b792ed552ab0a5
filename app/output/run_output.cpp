// SPDX-License-Identifier: Apache-2.0
#include "app/output/run_output.h"

#include <algorithm>

#include "app/files/text_file.h"

namespace docent::app {

namespace {

// tx ty tz qx qy qz qw of the camera in the map. Of the two equivalent quaternions, the one with qw >= 0 is
// written.
std::string FormatPose(const engine::Rigid3& camera_from_map, char separator) {
  const engine::Rigid3 map_from_camera = camera_from_map.inverse();
  const Eigen::Vector3d& t = map_from_camera.translation;
  Eigen::Vector4d q = map_from_camera.rotation.quaternion().coeffs();  // x y z w
  if (q.w() < 0) q = -q;
  std::string text;
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    if (!text.empty()) text += separator;
    text += FormatNumber(value);
  }
  return text;
}

std::filesystem::path MadeFolder(const std::filesystem::path& folder) {
  MakeFolder(folder);
  return folder;
}

}  // namespace

std::string CsvField(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string FormatFrameLine(const engine::TrackedFrame& frame, std::string_view map_name) {
  const double tracking_ms = ToSeconds(frame.tracking_time) * 1e3;
  return FormatSeconds(frame.frame.time) + ',' + std::to_string(frame.frame.camera) + ',' +
         ToString(frame.state) + ',' + CsvField(map_name) + ',' + std::to_string(frame.finite_points) + ',' +
         std::to_string(frame.infinite_points) + ',' + FormatNumber(frame.quality, 4) + ',' +
         FormatNumber(tracking_ms, 6) + ',' +
         (engine::HasPose(frame.state) ? FormatPose(frame.camera_from_map, ',') : ",,,,,,");
}

std::string FormatTrajectoryLine(const engine::TrackedFrame& frame) {
  return FormatSeconds(frame.frame.time) + ' ' + FormatPose(frame.camera_from_map, ' ');
}

std::string FormatEventLine(const Event& event) {
  return FormatSeconds(event.time) + ',' + CsvField(event.event) + ',' + CsvField(event.detail);
}

RunOutput::RunOutput(const std::filesystem::path& folder)
    : folder_(MadeFolder(folder)), frames_(folder / "frames.csv"), events_(folder / "events.csv") {
  frames_.Write("timestamp,camera,state,map,finite,infinite,quality,tracking_ms,tx,ty,tz,qx,qy,qz,qw\n");
  WriteToEvents("timestamp,event,detail\n");
  Trajectory(0);
}

CheckedFile& RunOutput::Trajectory(int camera) {
  const std::string name = camera == 0 ? "trajectory.txt" : "trajectory_" + std::to_string(camera) + ".txt";
  return trajectories_.try_emplace(camera, folder_ / name).first->second;
}

void RunOutput::Add(const engine::TrackedFrame& frame, std::string_view map_name) {
  frames_.Write(FormatFrameLine(frame, map_name) + '\n');
  if (engine::HasPose(frame.state)) Trajectory(frame.frame.camera).Write(FormatTrajectoryLine(frame) + '\n');
}

void RunOutput::Add(const Event& event) {
  const std::string line = FormatEventLine(event) + '\n';
  event_lines_.push_back({event.time, events_size_, line.size()});
  WriteToEvents(line);
}

void RunOutput::WriteToEvents(std::string_view text) {
  events_.Write(text);
  events_.Flush();
  events_size_ += text.size();
}

// The events are written when they happen, so that those of a program that was killed can be read, and put
// into order at the end.
void RunOutput::SortEvents() const {
  const auto is_earlier = [](const EventLine& a, const EventLine& b) { return a.time < b.time; };
  if (std::is_sorted(event_lines_.begin(), event_lines_.end(), is_earlier)) return;
  std::vector<EventLine> lines = event_lines_;
  std::stable_sort(lines.begin(), lines.end(), is_earlier);
  const std::string text = ReadTextFile(folder_ / "events.csv", events_size_);
  std::string sorted = text.substr(0, event_lines_.front().begin);  // the header
  for (const EventLine& line : lines) sorted += std::string_view(text).substr(line.begin, line.size);
  WriteTextFile(folder_ / "events.csv", sorted);
}

void RunOutput::Close() {
  frames_.Close();
  events_.Close();
  SortEvents();
  for (auto& [camera, file] : trajectories_) file.Close();
}

}  // namespace docent::app
