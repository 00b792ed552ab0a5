// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/run_record.h"

#include <algorithm>
#include <fstream>

#include "app/files/text_file.h"
#include "engine/map/map.h"
#include "engine/map/map_readout.h"
#include "engine/map/upright_axes.h"
#include "engine/mapping/bundle/map_adjustment.h"

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

// The inliers that are finite points.
std::vector<InitializationRecord::Point> FinitePoints(const engine::TrackedFrame& frame) {
  std::vector<InitializationRecord::Point> points;
  for (const engine::PointMatch& match : frame.matches) {
    if (!match.inlier) continue;
    const engine::MapPoint* point = frame.map->FindPoint(match.point);
    if (point == nullptr || point->infinite()) continue;
    points.push_back({match.pixel, (frame.camera_from_map * point->position()).z()});
  }
  return points;
}

// Median by nearest rank; 0 without points.
double MedianDepth(const std::vector<InitializationRecord::Point>& points) {
  std::vector<double> depths;
  for (const InitializationRecord::Point& point : points) depths.push_back(point.depth);
  if (depths.empty()) return 0;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

}  // namespace

void RunRecorder::AddInitialization(const engine::TrackedFrame& frame,
                                    const std::vector<InitializationRecord::Point>& points) {
  const bool known =
      std::any_of(initializations_.begin(), initializations_.end(),
                  [&frame](const InitializationRecord& start) { return start.map_key == frame.map_key; });
  if (known) return;
  InitializationRecord start;
  start.map_key = frame.map_key;
  start.frame = frames_.size();
  for (const engine::KeyFrame& keyframe : frame.map->keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kSixDof)
      start.keyframes.push_back({keyframe.time, keyframe.camera_from_map});
  }
  const std::size_t count = std::min(points.size(), InitializationRecord::kMaxPoints);
  for (std::size_t i = 0; i < count; ++i) start.points.push_back(points[i * points.size() / count]);
  initializations_.push_back(std::move(start));
}

void RunRecorder::Add(const engine::TrackedFrame& frame, const MappingTimes& mapping) {
  FrameRecord record;
  record.time = frame.frame.time;
  record.state = frame.state;
  record.map_key = frame.map_key;
  record.camera_from_map = frame.camera_from_map;
  record.finite_points = frame.finite_points;
  record.infinite_points = frame.infinite_points;
  record.quality = frame.quality;
  record.mapping = mapping;
  record.tracking_ms = ToSeconds(frame.tracking_time) * 1e3;
  if (frame.map) {
    // Counted only for a new revision, because maps change far less often than frames arrive.
    if (frames_.empty() || counted_map_ != frame.map_key || counted_revision_ != frame.map->revision) {
      keyframes_ = CountKeyFrames(*frame.map);
      points_ = CountPoints(*frame.map);
      counted_map_ = frame.map_key;
      counted_revision_ = frame.map->revision;
    }
    record.map_keyframes = keyframes_;
    record.map_points = points_;
    if (engine::HasPose(frame.state)) {
      const std::vector<InitializationRecord::Point> points = FinitePoints(frame);
      record.median_depth = MedianDepth(points);
      if (points_.finite > 0) AddInitialization(frame, points);
    }
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
    if (point.infinite()) continue;
    record.positions.push_back(point.position());
    record.converted.push_back(point.was_infinite);
  }
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kPanorama) continue;
    auto& centers = keyframe.panorama == engine::kNoId ? record.sixdof_centers : record.localized_centers;
    centers.push_back(keyframe.camera_from_map.OriginInSource());
  }
  for (const engine::PanoramaMap& panorama : map.panoramas) {
    if (const engine::KeyFrame* reference = map.FindKeyFrame(panorama.reference))
      record.panorama_centers.push_back(reference->camera_from_map.OriginInSource());
  }
  if (!map.keyframes.empty()) record.readout_s = engine::ReadoutIn(map, *map.keyframes.back().camera);
  const engine::UprightAxes axes = engine::UprightAxesOf(map);
  record.up = axes.up;
  record.forward = axes.ahead;
  return record;
}

std::vector<std::pair<Timestamp, Eigen::Vector3d>> AdjustedCenters(const engine::MapSnapshot& snapshot) {
  engine::Map map(snapshot);
  engine::AdjustGlobally({}, nullptr, &map);
  std::vector<std::pair<Timestamp, Eigen::Vector3d>> centers;
  for (const auto& [id, record] : map.keyframes()) {
    if (record.keyframe.kind == engine::KeyFrameKind::kPanorama) continue;
    centers.emplace_back(record.keyframe.time, record.keyframe.camera_from_map.OriginInSource());
  }
  return centers;
}

LensRecord MakeLensRecord(const engine::EstimatedLens& lens) {
  return {.focal_px = lens.model->intrinsics().fx,
          .k1 = lens.model->distortion()[0],
          .focal_sigma_percent = 100 * lens.focal_sigma,
          .fixed = lens.fixed};
}

MappingTimes MakeMappingTimes(const engine::MapperTimes& times) {
  return {times.bundle_adjustment,
          times.panorama_localization,
          times.infinite_triangulation,
          times.loop_closing,
          times.other,
          times.max_queue_latency,
          times.loops_closed};
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
  std::ofstream("/proc/self/clear_refs")
      << "5";  // See proc(5). If this is not permitted, the old peak remains.
}

}  // namespace docent::app
