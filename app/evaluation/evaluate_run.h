// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/evaluation/run_record.h"
#include "engine/geometry/sim3.h"

// Accuracy of a run compared with ground truth. Poses are those delivered live. A frame in a map that was
// discarded later counts as untracked, because the user saw a result that the engine retracted. This does not
// apply to a discarded map with infinite points only, because its rotations remain correct.
//
// Each map has its own coordinate frame and scale, so poses are compared for each map separately: the
// similarity truth_from_map is estimated by least squares over the camera centres (Umeyama 1991), and the
// error is the root mean square of the remaining distances. The figures of the whole sequence are those of
// the largest map, the one with most tracked frames. A map has infinite points only until its camera has
// moved. Such a map defines the rotation of the camera but not its position: its frames count as tracked and
// have a rotation error, but they take no part in the alignment and the position error.
namespace docent::app {

// Where the truth covers fewer frames than this, a similarity fits them whatever their errors, and the RMS
// errors are unknown.
inline constexpr int kMinComparedFrames = 10;

struct EvaluationOptions {
  Timestamp max_time_difference = std::chrono::milliseconds(10);  // Between a frame and its true pose.
};

// One frame compared with the truth; members are empty when there is nothing to compare.
struct FrameResult {
  bool tracked = false;       // Has a pose in a map that was kept.
  bool has_position = false;  // That map also had finite points.
  // By the map's alignment; empty if fewer than kMinComparedFrames of the map have a position and a true
  // pose.
  std::optional<Eigen::Vector3d> position_in_truth;
  std::optional<double> position_error_m;
  std::optional<double> rotation_error_deg;  // After aligning rotations.
};

struct MapResult {
  std::uint64_t key = 0;
  std::string name;
  bool discarded = false;
  std::string joined_into = {};  // See MapRecord.
  int frames = 0;                // Frames with a pose in this map.
  int compared_frames = 0;       // Of these, those with a true pose.
  std::optional<double>
      ate_rmse_m;  // Empty for fewer than kMinComparedFrames, or centres that determine no similarity.
  // Error of the keyframes after a final global bundle adjustment: the accuracy of the map, whereas
  // ate_rmse_m is the accuracy of the live poses.
  std::optional<double> keyframe_ate_rmse_m;
  std::optional<double> scale;              // Metres of the truth per map unit.
  std::optional<double> rotation_rmse_deg;  // After the rotation that aligns the orientations best.
  std::optional<double>
      rotation_drift_deg;  // Error of the rotation from the first to the last frame with a pose.
  // Component of that drift about the axis of the true rotation, as in hybrid-slam §7.3; positive when the
  // tracked rotation is too large. Empty when the true rotation is too small to have an axis.
  std::optional<double> axis_drift_deg;
  // Number of the last frame with a true pose: the drifts above are up to it.
  std::optional<std::size_t> last_compared_frame = std::nullopt;
  std::optional<Eigen::Vector2d> readout_s = std::nullopt;  // see MapRecord
};

// All frames with one label.
struct SegmentResult {
  std::string label;
  int frames = 0, tracked = 0;
  double tracked_ratio = 0;          // Over all frames of the label.
  std::optional<double> ate_rmse_m;  // Each frame by the alignment of its own map.
};

struct SequenceReport {
  std::string name, engine;  // As in RunRecord.
  int frames = 0;
  int tracked = 0;                 // Frames with a pose in a map that was kept.
  int discarded_frames = 0;        // Frames with a pose in a discarded map; they count as untracked.
  bool has_truth = false;          // Whether there is ground truth, of whatever time.
  int compared_frames = 0;         // Tracked frames with a true pose.
  int directions_only_frames = 0;  // Tracked frames in a map without finite points, so without a position.
  double tracked_ratio = 0;        // Tracked over all frames from the first tracked one on, including it.
  std::optional<int> first_tracked_frame, last_tracked_frame;
  int relocalizations = 0;
  // Of the largest map.
  std::optional<double> ate_rmse_m, rotation_rmse_deg, rotation_drift_deg, axis_drift_deg, scale;
  KeyFrameCounts keyframes;  // Sums over the maps that were kept.
  PointCounts points;
  double tracking_median_ms = 0, tracking_p95_ms = 0, tracking_max_ms = 0;  // Without dropped frames.
  MappingTimes mapping;
  double wall_s = 0, peak_memory_mb = 0;
  std::optional<LensRecord> lens;          // As in RunRecord.
  std::vector<LensRing> lens_rings;        // As in RunRecord.
  std::vector<MapResult> maps;             // In the order of their first frame, then those without frames.
  std::optional<std::size_t> largest_map;  // Index in maps.
  std::vector<SegmentResult> segments;     // In the order of their first frame.
  std::vector<FrameResult> frame_results;  // One for each frame of the run.
};

// `truth` and `segments` may be empty.
SequenceReport EvaluateRun(const RunRecord& run, const std::vector<TimedPose>& truth,
                           const std::vector<TimedLabel>& segments, const EvaluationOptions& options = {});

// A sentence if the ground truth covers so few of the tracked frames that the errors say little; else empty.
std::string CoverageWarning(int compared_frames, int tracked_frames);

// Quantile of the values by the nearest-rank method; 0 without values. `part` is in (0, 1].
double Quantile(std::vector<double> values, double part);

}  // namespace docent::app
