// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/evaluation/run_record.h"

// Whether a map began with a depth that is the scene's. A start is false when the first second in which the
// map has depth disagrees with the truth by more than a tenth of its own path or depth.
//
// What a map claims in that second is a ratio: how far the camera moved in units of the depth of what it
// sees. The truth of a sequence has the motion in metres, and the depth can be worked out from it (see
// true_depth.h), at the very pixels where the map's points were found in its first frame with depth. So:
//
// Depth. The scale of the map, metres a unit, is the median over the points of true depth over told depth.
// The start is false when the median over the points of the relative error of depth, after this scale,
// exceeds the tolerance: these depths say nothing of the scene.
//
// Path. Centres are compared: those of the keyframes that gave the map its depth (StartRecord) and those of
// the frames with a pose in it during its first second with depth, after the rotation that aligns the
// orientations best, by this scale, and about their means. The rotation is not aligned by the centres, since
// a path along a line fits a line of any direction. The start is false when the root mean square of the error
// exceeds the tolerance times that of the map's own path. A camera that only turned, or moved by millimetres,
// in a map that claims a baseline of a twentieth of its depth is found by this.
//
// Where the true depth of fewer than `least_points` points is known, as the pixels could not be followed or
// the camera did not move enough later on either, the scale is that of least squares over the centres, not
// negative: the shape of the path alone is compared. As a scale of a path that hardly rises above the noise
// says little, the second is then extended until the true path is long enough for a tenth of it to be seen,
// up to `longest`, or to the end of the track. Such a start is also false when the depth that its scale
// implies, with the noise in its favour, is below `least_depth_m`.
//
// Noise of the truth does not make a start false: errors up to `noise_factor` times the noise are allowed in
// any case, and a start whose own and true path both lie below that is undecided.
namespace docent::app {

struct FalseStartOptions {
  Timestamp window = std::chrono::seconds(1);   // from the first frame in the map with depth
  Timestamp longest = std::chrono::seconds(5);  // of an extended window
  double tolerance = 0.1;                       // of path and of depth; the definition
  double least_depth_m = 0.2;                   // nothing that these sequences show is nearer
  double noise_factor = 2;                      // standard deviations: 95 % of what noise alone leaves
  // Standard deviation of a true centre in metres. Motion capture and laser trackers say millimetres and
  // KinectFusion one to two centimetres; clocks that differ by 5 ms add as much as 5 mm at a metre a second,
  // and a truth that is not that of the lens's own centre adds to turns. A simulation's is 0.
  double truth_noise_m = 0.01;
  std::size_t least_points = 15;  // with a true depth, for the scale; their median is known well by then
  Timestamp max_time_difference = std::chrono::milliseconds(10);  // as in EvaluationOptions

  // A sentence that says what is wrong, or empty.
  std::optional<std::string> Validate() const;
};

enum class StartVerdict {
  kRight,
  kFalsePath,   // the motion disagrees
  kFalseDepth,  // the depth disagrees
  kUndecided    // fewer than three centres with a truth, or no path that rises above the noise
};
const char* ToString(StartVerdict verdict);
inline bool IsFalse(StartVerdict verdict) {
  return verdict == StartVerdict::kFalsePath || verdict == StartVerdict::kFalseDepth;
}

struct StartResult {
  std::uint64_t map_key = 0;
  std::size_t frame = 0;  // the first with a pose in the map that had depth
  StartVerdict verdict = StartVerdict::kUndecided;
  bool discarded = false;             // the engine gave the map up during the run
  double window_s = 0;                // after extension
  int centers = 0;                    // that were compared
  int depth_points = 0;               // whose true depth was known
  bool scale_of_depth = false;        // or that of least squares over the centres
  std::optional<double> depth_error;  // median, relative; empty without scale_of_depth
  double error_m = 0;                 // root mean square, of the centres
  double path_m = 0,
         true_path_m = 0;  // root mean square about the mean: the map's own, by the scale, and true
  double depth_m = 0;      // median depth of the map by the scale; 0 where the map has none
};

// The true depths of the points of a start, in their order; see true_depth.h.
using TrueDepthSource = std::function<std::vector<std::optional<double>>(const StartRecord& start)>;

// One result for each of run.starts, in their order; empty without truth. `true_depths` may be empty: then
// they are all unknown. Throws Error when the options are not valid, and what true_depths throws.
std::vector<StartResult> JudgeStarts(const RunRecord& run, const std::vector<TimedPose>& truth,
                                     const TrueDepthSource& true_depths,
                                     const FalseStartOptions& options = {});

}  // namespace docent::app
