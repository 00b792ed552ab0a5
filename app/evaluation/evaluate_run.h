// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/evaluation/run_record.h"
#include "engine/geometry/sim3.h"

// How good a run was, against the truth. Poses are the live ones. A frame in a map that was later discarded
// counts as untracked: whoever wore the camera was shown something that the engine itself took back. (Not so
// where that map held directions alone: a turn that was shown stays true when the map is given up.)
//
// Each map has a frame and a scale of its own, so poses are compared map by map: the similarity
// truth_from_map of least squares over its camera centres (Umeyama 1991), then the root mean square of what
// remains. The figures of the whole sequence are those of the largest map, the one with most tracked frames.
// A map that holds directions alone, as one does from its first image until its camera has moved, says
// which way the camera looks and nothing of where it is: its frames are tracked and have a rotation, but they
// have no part in the alignment and the error of positions.
namespace docent::app {

struct EvaluationOptions {
  Timestamp max_time_difference = std::chrono::milliseconds(10);  // between a frame and its true pose
};

// One frame against the truth; empty members where there is nothing to compare.
struct FrameResult {
  bool tracked = false;                              // has a pose in a map that was kept
  bool has_position = false;                         // and that map knew depth
  std::optional<Eigen::Vector3d> position_in_truth;  // by the map's alignment
  std::optional<double> position_error_m;
  std::optional<double> rotation_error_deg;  // after aligning rotations
};

struct MapResult {
  std::uint64_t key = 0;
  std::string name;
  bool discarded = false;
  std::string joined_into = {};      // see MapRecord
  int frames = 0;                    // with a pose in this map
  std::optional<double> ate_rmse_m;  // empty without truth, or when the centres do not fix a similarity
  // Of its keyframes after one more adjustment of the whole map: what the map knows, where ate_rmse_m is what
  // the wearer saw.
  std::optional<double> keyframe_ate_rmse_m;
  std::optional<double> scale;               // truth metres a map metre
  std::optional<double> rotation_rmse_deg;   // after the rotation that aligns the orientations best
  std::optional<double> rotation_drift_deg;  // of the turn from the first to the last frame with a pose
  // The same about the true turn's own axis, as hybrid-slam §7.3 tells it: positive when the engine turned
  // too far. Empty where the camera ended looking as it began, as there is no axis then.
  std::optional<double> turn_error_deg;
};

// All frames with one label.
struct SegmentResult {
  std::string label;
  int frames = 0, tracked = 0;
  double tracked_ratio = 0;          // over all frames of the label
  std::optional<double> ate_rmse_m;  // each frame by its own map's alignment
};

struct SequenceReport {
  std::string name, engine;  // as in RunRecord
  int frames = 0;
  int tracked = 0;                 // with a pose in a map that was kept
  int discarded_frames = 0;        // with a pose in a map that was discarded; counted as untracked
  int directions_only_frames = 0;  // of the tracked ones: in a map without depth, so without a position
  double tracked_ratio = 0;        // tracked over all frames from the first tracked one on, that one included
  std::optional<int> first_tracked_frame, last_tracked_frame;
  int relocalizations = 0;
  // Of the largest map.
  std::optional<double> ate_rmse_m, rotation_rmse_deg, rotation_drift_deg, turn_error_deg, scale;
  KeyFrameCounts keyframes;  // sums over the maps that were kept
  PointCounts points;
  double tracking_median_ms = 0, tracking_p95_ms = 0, tracking_max_ms = 0;  // of frames that were not dropped
  MappingTimes mapping;
  double wall_s = 0, peak_memory_mb = 0;
  std::vector<LensRing> lens_rings;        // as in RunRecord
  std::vector<MapResult> maps;             // in the order of their first frame, then those without frames
  std::optional<std::size_t> largest_map;  // index in maps
  std::vector<SegmentResult> segments;     // in the order of their first frame
  std::vector<FrameResult> frame_results;  // one a frame of the run
};

// `truth` and `segments` may be empty.
SequenceReport EvaluateRun(const RunRecord& run, const std::vector<TimedPose>& truth,
                           const std::vector<TimedLabel>& segments, const EvaluationOptions& options = {});

// The value below which the given part of the values lies (nearest rank); 0 for none. part in (0, 1].
double Quantile(std::vector<double> values, double part);

}  // namespace docent::app
