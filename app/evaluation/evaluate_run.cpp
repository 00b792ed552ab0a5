// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/evaluate_run.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "app/evaluation/mean_rotation.h"

namespace docent::app {

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// A frame with a tracked pose and a true pose.
struct Pair {
  std::size_t frame = 0;
  engine::Rigid3 map_from_camera, truth_from_camera;
};

// Whether positions of the map were retracted. A map with infinite points only defines no positions.
bool IsRetracted(const MapRecord& map) {
  const bool without_depth = map.points.infinite > 0 && map.points.finite == 0;
  return map.discarded && !without_depth;
}

class RootMeanSquare {
 public:
  void Add(double value) {
    sum_ += value * value;
    ++count_;
  }
  std::optional<double> Get() const {
    return count_ == 0 ? std::nullopt : std::optional(std::sqrt(sum_ / static_cast<double>(count_)));
  }

 private:
  double sum_ = 0;
  std::size_t count_ = 0;
};

// The rotation that maps the axes of the map to those of the truth.
engine::Rotation3 TruthFromMapRotation(const std::vector<Pair>& pairs) {
  std::vector<engine::Rotation3> rotations;
  for (const Pair& pair : pairs) {
    rotations.push_back(pair.truth_from_camera.rotation * pair.map_from_camera.rotation.inverse());
  }
  return MeanRotation(rotations);
}

// The true rotation from the first to the last frame and the error of the tracked one, in the first camera's
// frame.
struct RotationDrift {
  engine::Rotation3 truth, error;  // error = truth^-1 * tracked
};

RotationDrift CompareRotation(const Pair& first, const Pair& last) {
  const auto relative = [](const engine::Rigid3& a, const engine::Rigid3& b) {
    return a.rotation.inverse() * b.rotation;
  };
  const engine::Rotation3 truth = relative(first.truth_from_camera, last.truth_from_camera);
  return {truth, truth.inverse() * relative(first.map_from_camera, last.map_from_camera)};
}

// Component of the error about the axis of the true rotation: the twist in the swing-twist decomposition.
std::optional<double> ErrorAboutAxis(const RotationDrift& drift) {
  constexpr double kMinRotation = 5 / kDegrees;
  const Eigen::Vector3d axis = drift.truth.Log();
  if (axis.norm() < kMinRotation) return std::nullopt;
  const Eigen::Quaterniond& q = drift.error.quaternion();
  const double half = std::atan2(q.vec().dot(axis.normalized()), q.w());
  return std::remainder(2 * half, 2 * std::numbers::pi) * kDegrees;
}

void CompareMap(const std::vector<Pair>& pairs, MapResult* map, std::vector<FrameResult>* frames) {
  map->compared_frames = static_cast<int>(pairs.size());
  if (pairs.empty()) return;
  map->last_compared_frame = pairs.back().frame;
  const engine::Rotation3 truth_from_map_rotation = TruthFromMapRotation(pairs);
  RootMeanSquare rotation_error;
  for (const Pair& pair : pairs) {
    const engine::Rotation3 aligned = truth_from_map_rotation * pair.map_from_camera.rotation;
    const double error_deg = (pair.truth_from_camera.rotation.inverse() * aligned).Angle() * kDegrees;
    (*frames)[pair.frame].rotation_error_deg = error_deg;
    rotation_error.Add(error_deg);
  }
  if (map->compared_frames >= kMinComparedFrames) {
    map->rotation_rmse_deg = rotation_error.Get();
    const RotationDrift drift = CompareRotation(pairs.front(), pairs.back());
    map->rotation_drift_deg = drift.error.Angle() * kDegrees;
    map->axis_drift_deg = ErrorAboutAxis(drift);
  }

  std::vector<std::size_t> positioned;  // Indices of frames.
  std::vector<Eigen::Vector3d> in_truth, in_map;
  for (const Pair& pair : pairs) {
    if (!(*frames)[pair.frame].has_position) continue;
    positioned.push_back(pair.frame);
    in_truth.push_back(pair.truth_from_camera.translation);
    in_map.push_back(pair.map_from_camera.translation);
  }
  if (positioned.size() < kMinComparedFrames) return;
  const std::optional<engine::Sim3> truth_from_map = engine::AlignSim3(in_truth, in_map);
  if (!truth_from_map) return;
  RootMeanSquare position_error;
  for (std::size_t i = 0; i < positioned.size(); ++i) {
    FrameResult& frame = (*frames)[positioned[i]];
    frame.position_in_truth = *truth_from_map * in_map[i];
    frame.position_error_m = (*frame.position_in_truth - in_truth[i]).norm();
    position_error.Add(*frame.position_error_m);
  }
  map->ate_rmse_m = position_error.Get();
  map->scale = truth_from_map->scale;
}

void CompareKeyFrames(const MapRecord& record, const std::vector<TimedPose>& truth,
                      const EvaluationOptions& options, MapResult* map) {
  std::vector<Eigen::Vector3d> in_truth, in_map;
  for (const auto& [time, center] : record.adjusted_centers) {
    const TimedPose* pose = FindPose(truth, time, options.max_time_difference);
    if (!pose) continue;
    in_truth.push_back(pose->truth_from_camera.translation);
    in_map.push_back(center);
  }
  const std::optional<engine::Sim3> truth_from_map = engine::AlignSim3(in_truth, in_map);
  if (!truth_from_map) return;
  RootMeanSquare error;
  for (std::size_t i = 0; i < in_map.size(); ++i)
    error.Add((*truth_from_map * in_map[i] - in_truth[i]).norm());
  map->keyframe_ate_rmse_m = error.Get();
}

// One result for each map, in the order of the first frames in them.
std::vector<MapResult> ListMaps(const RunRecord& run) {
  std::vector<MapResult> maps;
  const auto find = [&maps](std::uint64_t key) {
    return std::find_if(maps.begin(), maps.end(), [key](const MapResult& map) { return map.key == key; });
  };
  for (const FrameRecord& frame : run.frames) {
    if (!engine::HasPose(frame.state)) continue;
    const auto found = find(frame.map_key);
    if (found != maps.end()) {
      ++found->frames;
      continue;
    }
    MapResult map;
    map.key = frame.map_key;
    map.frames = 1;
    maps.push_back(map);
  }
  for (const MapRecord& record : run.maps) {
    auto found = find(record.key);
    if (found == maps.end()) {
      maps.emplace_back().key = record.key;
      found = std::prev(maps.end());
    }
    found->name = record.name;
    found->discarded = IsRetracted(record);
    found->joined_into = record.joined_into;
    found->readout_s = record.readout_s;
  }
  return maps;
}

void CountFrames(const RunRecord& run, SequenceReport* report) {
  std::map<std::uint64_t, bool> discarded;
  for (const MapRecord& map : run.maps) discarded[map.key] = IsRetracted(map);
  std::vector<double> tracking_ms;
  report->frames = static_cast<int>(run.frames.size());
  report->frame_results.resize(run.frames.size());
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const FrameRecord& frame = run.frames[i];
    if (frame.state != engine::TrackingState::kDropped) tracking_ms.push_back(frame.tracking_ms);
    if (!engine::HasPose(frame.state)) continue;
    if (discarded[frame.map_key]) {
      ++report->discarded_frames;
      continue;
    }
    report->frame_results[i].tracked = true;
    ++report->tracked;
    report->frame_results[i].has_position = !InMapWithoutDepth(frame);
    if (InMapWithoutDepth(frame)) ++report->directions_only_frames;
    if (frame.state == engine::TrackingState::kRelocalized) ++report->relocalizations;
    if (!report->first_tracked_frame) report->first_tracked_frame = static_cast<int>(i);
    report->last_tracked_frame = static_cast<int>(i);
  }
  if (report->first_tracked_frame) {
    report->tracked_ratio =
        static_cast<double>(report->tracked) / (report->frames - *report->first_tracked_frame);
  }
  report->tracking_median_ms = Quantile(tracking_ms, 0.5);
  report->tracking_p95_ms = Quantile(tracking_ms, 0.95);
  report->tracking_max_ms = Quantile(tracking_ms, 1);
}

void SumMaps(const RunRecord& run, SequenceReport* report) {
  for (const MapRecord& map : run.maps) {
    if (map.discarded || !map.joined_into.empty()) continue;
    report->keyframes.sixdof += map.keyframes.sixdof;
    report->keyframes.panorama += map.keyframes.panorama;
    report->keyframes.localized += map.keyframes.localized;
    report->points.finite += map.points.finite;
    report->points.infinite += map.points.infinite;
    report->points.converted += map.points.converted;
  }
}

void CompareWithTruth(const RunRecord& run, const std::vector<TimedPose>& truth,
                      const EvaluationOptions& options, SequenceReport* report) {
  report->has_truth = !truth.empty();
  std::map<std::uint64_t, std::vector<Pair>> pairs_of_map;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const FrameRecord& frame = run.frames[i];
    if (!report->frame_results[i].tracked) continue;
    const TimedPose* pose = FindPose(truth, frame.time, options.max_time_difference);
    if (!pose) continue;
    ++report->compared_frames;
    pairs_of_map[frame.map_key].push_back({i, frame.camera_from_map.inverse(), pose->truth_from_camera});
  }
  for (std::size_t i = 0; i < report->maps.size(); ++i) {
    MapResult& map = report->maps[i];
    if (map.discarded) continue;
    CompareMap(pairs_of_map[map.key], &map, &report->frame_results);
    for (const MapRecord& record : run.maps) {
      if (record.key == map.key) CompareKeyFrames(record, truth, options, &map);
    }
    const bool larger = !report->largest_map || map.frames > report->maps[*report->largest_map].frames;
    if (map.frames > 0 && larger) report->largest_map = i;
  }
  if (!report->largest_map) return;
  const MapResult& largest = report->maps[*report->largest_map];
  report->ate_rmse_m = largest.ate_rmse_m;
  report->scale = largest.scale;
  report->rotation_rmse_deg = largest.rotation_rmse_deg;
  report->rotation_drift_deg = largest.rotation_drift_deg;
  report->axis_drift_deg = largest.axis_drift_deg;
}

std::vector<SegmentResult> EvaluateSegments(const RunRecord& run, const std::vector<TimedLabel>& labels,
                                            const std::vector<FrameResult>& results) {
  const bool has_errors = std::count_if(results.begin(), results.end(), [](const FrameResult& frame) {
                            return frame.position_error_m.has_value();
                          }) >= kMinComparedFrames;
  std::vector<SegmentResult> segments;
  std::vector<RootMeanSquare> errors;
  std::map<std::string, std::size_t> index_of_label;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const TimedLabel* label = FindLabel(labels, run.frames[i].time);
    if (!label) continue;
    const auto [entry, is_new] = index_of_label.try_emplace(label->label, segments.size());
    if (is_new) {
      segments.emplace_back().label = label->label;
      errors.emplace_back();
    }
    SegmentResult& segment = segments[entry->second];
    ++segment.frames;
    if (results[i].tracked) ++segment.tracked;
    if (has_errors && results[i].position_error_m) errors[entry->second].Add(*results[i].position_error_m);
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    segments[i].tracked_ratio = static_cast<double>(segments[i].tracked) / segments[i].frames;
    segments[i].ate_rmse_m = errors[i].Get();
  }
  return segments;
}

}  // namespace

std::string CoverageWarning(int compared_frames, int tracked_frames) {
  constexpr double kSmallShare = 0.25;
  if (compared_frames == tracked_frames ||
      (compared_frames >= kMinComparedFrames && compared_frames >= kSmallShare * tracked_frames)) {
    return {};
  }
  return "only " + std::to_string(compared_frames) + " of " + std::to_string(tracked_frames) +
         " tracked frames have a true pose";
}

double Quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  const double rank = std::ceil(part * static_cast<double>(values.size()));
  const auto index = static_cast<std::size_t>(std::clamp(rank, 1.0, static_cast<double>(values.size()))) - 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

SequenceReport EvaluateRun(const RunRecord& run, const std::vector<TimedPose>& truth,
                           const std::vector<TimedLabel>& segments, const EvaluationOptions& options) {
  SequenceReport report;
  report.name = run.name;
  report.engine = run.engine;
  report.mapping = run.mapping;
  report.wall_s = run.wall_s;
  report.lens = run.lens;
  report.lens_rings = run.lens_rings;
  report.peak_memory_mb = run.peak_memory_mb;
  report.maps = ListMaps(run);
  CountFrames(run, &report);
  SumMaps(run, &report);
  CompareWithTruth(run, truth, options, &report);
  report.segments = EvaluateSegments(run, segments, report.frame_results);
  return report;
}

}  // namespace docent::app
