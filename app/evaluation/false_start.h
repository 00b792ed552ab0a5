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

// Whether a map began with a depth that is the scene's. A start is false when the first second in which the
// map has depth disagrees with the truth by more than a tenth of its own path or depth.
//
// What a map claims in that second is a ratio: how far the camera moved in units of the depth of what it
// sees. The truth of a sequence has the motion in metres, and depths can be worked out from it with an
// uncertainty (see true_depth.h), at the very pixels where the map's points were found in its first frame
// with depth. So:
//
// Path. Centres are compared: those of the keyframes that gave the map its depth (StartRecord) and those of
// the frames with a pose in it during its first second with depth, after the rotation that aligns the
// orientations best, and about their means. The rotation is not aligned by the centres, since a path along a
// line fits a line of any direction. The scale, metres a unit of the map, is the one of least squares over
// the centres that is not negative and that the depths allow: true over told depth, the median over the
// points, with `sigmas` of its uncertainty either way. The start is false when the root mean square of the
// error exceeds the tolerance times that of the map's own path. A camera that only turned, or moved by
// millimetres, in a map that claims a baseline of a twentieth of its depth is found by this: the depths say
// that the scene is not centimetres away.
//
// Depth. Where the scale is known from the depths to the tolerance, the start is also false when the median
// over the points of the relative error of depth, after the scale of the depths, exceeds it: these depths say
// nothing of the scene.
//
// The depths say nothing where fewer than `least_points` points could be followed, or a recorded camera never
// moved. Then the shape of the path alone is compared; and as a scale of a path that hardly rises above the
// noise says little, the second is extended until the true path is long enough for a tenth of it to be seen,
// up to `longest`, or to the end of the track.
//
// Noise of the truth does not make a start false: errors up to `sigmas` times the noise are allowed in any
// case, and a start whose own and true path both lie below that is undecided.
namespace docent::app {

struct FalseStartOptions {
  Timestamp window = std::chrono::seconds(1);   // from the first frame in the map with depth
  Timestamp longest = std::chrono::seconds(5);  // of an extended window
  double tolerance = 0.1;                       // of path and of depth; the definition
  double sigmas = 2;                            // of noise, one way: 95 % of what noise alone leaves
  // Standard deviation of a true centre in metres. Motion capture and laser trackers say millimetres and
  // KinectFusion one to two centimetres; clocks that differ by 5 ms add as much as 5 mm at a metre a second,
  // and a truth that is not that of the lens's own centre adds to turns. A simulation's is 0.
  double truth_noise_m = 0.01;
  std::size_t least_points = 15;  // with a true depth; their median hardly depends on one of them then
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
  bool discarded = false;  // the engine gave the map up during the run
  double window_s = 0;     // after extension
  int centers = 0;         // that were compared
  int depth_points = 0;    // whose true depth was known
  // Median depth of the map in metres: by the truth at least and at most, and by the scale that was taken.
  std::optional<double> least_depth_m, most_depth_m, depth_m;
  std::optional<double> depth_error;  // median, relative; empty where the scale is not known well enough
  double error_m = 0;                 // root mean square, of the centres
  double path_m = 0,
         true_path_m = 0;  // root mean square about the mean: the map's own, by the scale, and true
};

// The true depths of the points of a start, in their order; see true_depth.h.
using TrueDepthSource = std::function<TrueDepths(const StartRecord& start)>;

// One result for each of run.starts, in their order; empty without truth. `true_depths` may be empty: then
// they are all unknown. Throws Error when the options are not valid, and what true_depths throws.
std::vector<StartResult> JudgeStarts(const RunRecord& run, const std::vector<TimedPose>& truth,
                                     const TrueDepthSource& true_depths,
                                     const FalseStartOptions& options = {});

}  // namespace docent::app
