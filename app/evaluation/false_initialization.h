// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/evaluation/run_record.h"
#include "app/evaluation/true_depth.h"

// Detects false initializations: maps whose initial depth is wrong. An initialization is false when the first
// second in which the map has finite points disagrees with the ground truth by more than a tenth of its path
// or depth.
//
// What a map states in that second is a ratio: the distance that the camera moved over the depth of the
// scene. The ground truth has the motion in metres, and depths can be computed from it with an uncertainty
// (see true_depth.h) at the pixels where the map points were found in the first frame with finite points. Two
// criteria are applied.
//
// Path. The camera centres are compared: those of the keyframes that initialized the map
// (InitializationRecord) and those of the frames with a pose in the map during its first second with finite
// points. Both paths are centred and rotated by the rotation that aligns the orientations best. The centres
// are not used for this rotation, because a straight path fits a straight path of any direction. The scale
// (metres per map unit) minimizes the squared distances of the centres, but must not be negative and must
// agree with the depths: it is limited to the median ratio of true depth to map depth, plus or minus `sigmas`
// standard deviations. The initialization is false when the RMS error exceeds the tolerance times the RMS
// length of the map's path. This detects a camera that only rotated, or moved by millimetres, in a map with a
// baseline of a twentieth of its depth, because according to the depths the scene is not centimetres away.
//
// Depth. If the depths determine the scale to within the tolerance, the initialization is also false when the
// median relative error of the depths, after scaling, exceeds the tolerance: these depths do not describe the
// scene.
//
// The depths are not usable when fewer than `min_points` points could be tracked, or when a recorded camera
// never moved. Then only the shape of the paths is compared. The scale of a path that is hardly longer than
// the noise means little, so the window is extended until a tenth of the true path exceeds the noise, up to
// `max_window` or the end of the track.
//
// Noise of the ground truth does not make an initialization false: errors up to `sigmas` times the noise are
// always allowed, and an initialization is undecided when both paths are shorter than that.
namespace docent::app {

struct FalseInitializationOptions {
  Timestamp window = std::chrono::seconds(1);      // From the first frame in the map with finite points.
  Timestamp max_window = std::chrono::seconds(5);  // Maximum length of an extended window.
  double tolerance = 0.1;                          // Relative error of path and depth; by definition.
  double sigmas = 2;  // Allowed noise in standard deviations; covers 95 % of the errors caused by noise.
  // Standard deviation of a true camera centre in metres. Motion capture and laser trackers are accurate to
  // millimetres, KinectFusion to one to two centimetres. Clocks that differ by 5 ms add up to 5 mm at 1 m/s,
  // and a tracked point other than the lens centre adds an error during rotations. 0 for simulations.
  double truth_noise_m = 0.01;
  // Points with a true depth that are needed; with 15, the median hardly depends on a single point.
  std::size_t min_points = 15;
  Timestamp max_time_difference = std::chrono::milliseconds(10);  // As in EvaluationOptions.

  // Describes the first invalid option, or empty.
  std::optional<std::string> Validate() const;
};

enum class InitializationOutcome {
  kRight,
  kFalsePath,   // The motion disagrees with the truth.
  kFalseDepth,  // The depth disagrees with the truth.
  kUndecided    // Fewer than three centres have a truth, or no path exceeds the noise.
};
const char* ToString(InitializationOutcome outcome);
inline bool IsFalse(InitializationOutcome outcome) {
  return outcome == InitializationOutcome::kFalsePath || outcome == InitializationOutcome::kFalseDepth;
}

struct InitializationResult {
  std::uint64_t map_key = 0;
  std::size_t frame = 0;  // Index of the first frame with a pose in the map when it had finite points.
  InitializationOutcome outcome = InitializationOutcome::kUndecided;
  bool discarded = false;  // The engine discarded the map during the run.
  double window_s = 0;     // Length of the window after extension.
  int centers = 0;         // Number of centres compared.
  int depth_points = 0;    // Number of points with a known true depth.
  // Median depth of the map in metres: smallest and largest value that the true depths allow, and the value
  // with the estimated scale.
  std::optional<double> min_depth_m, max_depth_m, depth_m;
  std::optional<double> depth_error;  // Median relative error; empty when the scale is too uncertain.
  double error_m = 0;                 // RMS distance of the centres.
  double path_m = 0,
         true_path_m = 0;  // RMS distance of the centres from their mean: in the map after scaling, and true.
};

// Returns the true depths of the points of an initialization, in their order; see true_depth.h.
using TrueDepthSource = std::function<TrueDepths(const InitializationRecord& start)>;

// Classifies run.initializations in their order; empty without truth. If `true_depths` is empty, all true
// depths are unknown. Throws Error when the options are invalid, and any exception of true_depths.
std::vector<InitializationResult> ClassifyInitializations(const RunRecord& run,
                                                          const std::vector<TimedPose>& truth,
                                                          const TrueDepthSource& true_depths,
                                                          const FalseInitializationOptions& options = {});

}  // namespace docent::app
