// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/run_record.h"

#include <fstream>

#include "app/files/text_file.h"

namespace docent::app {

namespace {

KeyFrameCounts CountKeyFrames(const engine::MapSnapshot& map) {
  KeyFrameCounts counts;
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kPanorama) {
      ++counts.panorama;
    } else {
      ++(keyframe.panorama == engine::kNoId ? counts.sixdof : counts.localized);
    }
  }
  return counts;
}

PointCounts CountPoints(const engine::MapSnapshot& map) {
  PointCounts counts;
  for (const engine::MapPoint& point : map.points) {
    ++(point.infinite() ? counts.infinite : counts.finite);
    counts.converted += point.was_infinite;
  }
  return counts;
}

}  // namespace

void RunRecorder::Add(const engine::TrackedFrame& frame) {
  FrameRecord record;
  record.time = frame.frame.time;
  record.state = frame.state;
  record.map_key = frame.map_key;
  record.camera_from_map = frame.camera_from_map;
  record.finite_points = frame.finite_points;
  record.infinite_points = frame.infinite_points;
  record.quality = frame.quality;
  record.tracking_ms = ToSeconds(frame.tracking_time) * 1e3;
  if (frame.map) {
    // Maps change far less often than frames come.
    if (frames_.empty() || counted_map_ != frame.map_key || counted_revision_ != frame.map->revision) {
      keyframes_ = CountKeyFrames(*frame.map);
      points_ = CountPoints(*frame.map);
      counted_map_ = frame.map_key;
      counted_revision_ = frame.map->revision;
    }
    record.map_keyframes = keyframes_;
    record.map_points = points_;
  }
  frames_.push_back(record);
}

MapRecord MakeMapRecord(std::uint64_t key, const std::string& name, const engine::MapSnapshot& map) {
  MapRecord record;
  record.key = key;
  record.name = name;
  record.keyframes = CountKeyFrames(map);
  record.points = CountPoints(map);
  for (const engine::MapPoint& point : map.points) {
    if (!point.infinite()) record.positions.push_back(point.position());
  }
  return record;
}

double PeakMemoryMegabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("VmHWM:")) continue;
    const auto fields = SplitFields(std::string_view(line).substr(6));
    const auto kilobytes = fields.empty() ? std::nullopt : ParseNumber(fields[0]);
    return kilobytes.value_or(0) / 1024;
  }
  return 0;
}

void ResetPeakMemory() {
  std::ofstream("/proc/self/clear_refs") << "5";  // see proc(5); where it is refused the peak goes on
}

}  // namespace docent::app
