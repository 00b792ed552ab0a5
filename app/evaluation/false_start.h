// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/evaluation/run_record.h"

// Whether a map began with a depth that is the scene's. A start is false when the first second in which the
// map has depth disagrees with the truth by more than a tenth of its own path or depth.
//
// Path. What is compared are camera centres: those of the keyframes that gave the map its depth (StartRecord)
// and those of the frames with a pose in it during its first second with depth. Their directions count, so
// the rotation truth_from_map is the one that aligns the orientations best, not the centres: a path along a
// line fits a line of any direction otherwise. Scale and translation are then those of least squares over the
// centres, with a scale that is not negative. The start is false when the root mean square of what remains,
// in metres, exceeds a tenth of the path. The path is the largest distance of two of the map's centres, in
// metres; a map whose motion has nothing to do with the truth gets a scale near zero and so a short path.
//
// Depth. Truth of a recorded sequence has no depth, but the scale above says how many metres the median depth
// of the map is. A camera that only turned, or whose baseline was millimetres, and a map that claims a
// baseline of a twentieth of its depth make that a depth of centimetres, nearer than any camera here can
// focus; the start is false when the median depth is below `least_depth_m` even if the path was longer by the
// truth's noise.
//
// Noise of the truth. It must not make a start false, so a root mean square below `noise_factor` times the
// noise is no disagreement, and where the path is shorter than what a tenth of it needs to rise above that,
// the second is extended until it is long enough, up to `longest`, or to the end of the track in this map.
namespace docent::app {

struct FalseStartOptions {
  Timestamp window = std::chrono::seconds(1);   // from the first frame in the map with depth
  Timestamp longest = std::chrono::seconds(5);  // of an extended window
  double tolerance = 0.1;                       // of path; the definition
  double least_depth_m = 0.1;                   // see above
  double noise_factor = 2;                      // two standard deviations: 95 % of what noise alone leaves
  // Standard deviation of a true centre, each coordinate, in metres; empty: EstimateTruthNoise.
  std::optional<double> truth_noise_m;
  Timestamp max_time_difference = std::chrono::milliseconds(10);  // as in EvaluationOptions

  // A sentence that says what is wrong, or empty.
  std::optional<std::string> Validate() const;
};

enum class StartVerdict {
  kRight,
  kFalsePath,   // the motion disagrees
  kFalseDepth,  // the motion may be right, but the depth cannot be
  kUndecided    // fewer than three centres with a truth, or a path that does not rise above the noise
};
const char* ToString(StartVerdict verdict);
inline bool IsFalse(StartVerdict verdict) {
  return verdict == StartVerdict::kFalsePath || verdict == StartVerdict::kFalseDepth;
}

struct StartResult {
  std::uint64_t map_key = 0;
  std::size_t frame = 0;  // the first with a pose in the map that had depth
  StartVerdict verdict = StartVerdict::kUndecided;
  bool discarded = false;    // the engine gave the map up during the run
  double window_s = 0;       // after extension
  int centers = 0;           // that were compared
  double error_m = 0;        // root mean square
  double path_m = 0;         // of the map, by the scale
  double true_path_m = 0;    // largest distance of two true centres
  double depth_m = 0;        // median depth of the map by the scale; 0 where the map has none
  double claimed_ratio = 0;  // the map's path over its median depth
};

// The standard deviation of a coordinate of the true centres at the given times, from their fourth
// differences: a hand's or a drone's motion, at a camera's rate, leaves nearly nothing in these, and white
// noise is multiplied by sqrt(70). The median makes it robust. Slow errors of the truth, which bend a path of
// a second by little, are not in it. 0 with fewer than five times that have a truth.
double EstimateTruthNoise(const std::vector<TimedPose>& truth, const std::vector<FrameRecord>& frames,
                          Timestamp max_time_difference);

// One result for each of run.starts, in their order; empty without truth. Throws Error when the options are
// not valid.
std::vector<StartResult> JudgeStarts(const RunRecord& run, const std::vector<TimedPose>& truth,
                                     const FalseStartOptions& options = {});

}  // namespace docent::app
