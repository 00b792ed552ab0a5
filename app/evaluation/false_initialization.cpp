// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/false_initialization.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "app/evaluation/mean_rotation.h"
#include "engine/base/error.h"
#include "engine/base/median.h"

namespace docent::app {

namespace {

// A tracked pose and the true pose of the same image.
struct PosePair {
  engine::Rigid3 map_from_camera, truth_from_camera;
};

// Camera centres relative to their mean; those of the map are rotated into the axes of the truth.
struct Paths {
  std::vector<Eigen::Vector3d> truth, map;

  explicit Paths(const std::vector<PosePair>& pairs) {
    std::vector<engine::Rotation3> rotations;
    for (const PosePair& pair : pairs) {
      rotations.push_back(pair.truth_from_camera.rotation * pair.map_from_camera.rotation.inverse());
    }
    const engine::Rotation3 truth_from_map = MeanRotation(rotations);
    for (const PosePair& pair : pairs) {
      truth.push_back(pair.truth_from_camera.translation);
      map.push_back(truth_from_map * pair.map_from_camera.translation);
    }
    Center(&truth);
    Center(&map);
  }

  static void Center(std::vector<Eigen::Vector3d>* points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& point : *points) mean += point;
    mean /= static_cast<double>(points->size());
    for (Eigen::Vector3d& point : *points) point -= mean;
  }

  static double RootMeanSquare(const std::vector<Eigen::Vector3d>& points) {
    double sum = 0;
    for (const Eigen::Vector3d& point : points) sum += point.squaredNorm();
    return std::sqrt(sum / static_cast<double>(points.size()));
  }

  // Least-squares scale, at least 0.
  double Scale() const {
    double product = 0, square = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      product += truth[i].dot(map[i]);
      square += map[i].squaredNorm();
    }
    return square > 0 ? std::max(0.0, product / square) : 0;
  }

  double Error(double scale) const {
    std::vector<Eigen::Vector3d> errors;
    for (std::size_t i = 0; i < map.size(); ++i) errors.push_back(truth[i] - scale * map[i]);
    return RootMeanSquare(errors);
  }
};

// Scale of the map in metres per map unit, estimated from the true depths.
struct DepthComparison {
  int points = 0;               // Number of points with a true depth.
  double inverse = 0;           // 1 / scale.
  double sigma = 0;             // Standard deviation of `inverse`.
  std::optional<double> error;  // Median relative error of the depths after scaling.
};

// Uses the median over the half of the points with the smaller uncertainty: those that were tracked for long,
// and so seen with a large baseline. The errors of the points are correlated, so the median is not more
// accurate than a single point.
DepthComparison CompareDepths(const InitializationRecord& start, const TrueDepthSource& true_depths,
                              const FalseInitializationOptions& options) {
  DepthComparison comparison;
  if (!true_depths) return comparison;
  const TrueDepths depths = true_depths(start);
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < start.points.size() && i < depths.size(); ++i) {
    if (depths[i] && start.points[i].depth > 0) known.push_back(i);
  }
  comparison.points = static_cast<int>(known.size());
  if (known.size() < options.min_points) return comparison;
  // Sorted by the uncertainty of the true depth, because the map depth may be wrong.
  std::stable_sort(known.begin(), known.end(),
                   [&depths](std::size_t a, std::size_t b) { return depths[a]->sigma < depths[b]->sigma; });
  known.resize(std::max(options.min_points, known.size() / 2));
  std::vector<double> sigmas, values, errors;
  for (const std::size_t i : known) {
    sigmas.push_back(depths[i]->sigma * start.points[i].depth);
    values.push_back(depths[i]->inverse * start.points[i].depth);
  }
  comparison.inverse = Median(values);
  comparison.sigma = Median(std::move(sigmas));
  if (!(options.sigmas * comparison.sigma < options.tolerance * comparison.inverse)) return comparison;
  for (const double value : values) errors.push_back(std::abs(value / comparison.inverse - 1));
  comparison.error = Median(std::move(errors));
  return comparison;
}

class InitializationClassifier {
 public:
  InitializationClassifier(const RunRecord& run, const std::vector<TimedPose>& truth,
                           const TrueDepthSource& true_depths, const FalseInitializationOptions& options)
      : run_(run),
        truth_(truth),
        true_depths_(true_depths),
        options_(options),
        noise_m_(options.sigmas * options.truth_noise_m) {}

  InitializationResult Classify(const InitializationRecord& start) const {
    InitializationResult result;
    result.map_key = start.map_key;
    result.frame = start.frame;
    for (const MapRecord& map : run_.maps) {
      if (map.key == start.map_key) result.discarded = map.discarded;
    }
    const DepthComparison depth = CompareDepths(start, true_depths_, options_);
    result.depth_points = depth.points;
    result.depth_error = depth.error;
    const bool bounded = static_cast<std::size_t>(depth.points) >= options_.min_points;
    const std::vector<PosePair> pairs = PairsInWindow(start, !bounded, &result);
    result.centers = static_cast<int>(pairs.size());
    if (pairs.size() < 3) return result;
    const Paths paths(pairs);
    const double map_depth = run_.frames[start.frame].median_depth;
    double scale = paths.Scale();
    if (bounded) {
      const double margin = options_.sigmas * depth.sigma;
      const double most_inverse = depth.inverse + margin, least_inverse = depth.inverse - margin;
      if (most_inverse > 0) {
        scale = std::max(scale, 1 / most_inverse);
        result.min_depth_m = map_depth / most_inverse;
      }
      if (least_inverse > 0) {
        scale = std::min(scale, 1 / least_inverse);
        result.max_depth_m = map_depth / least_inverse;
      }
    }
    if (map_depth > 0) result.depth_m = scale * map_depth;
    result.error_m = paths.Error(scale);
    result.path_m = scale * Paths::RootMeanSquare(paths.map);
    result.true_path_m = Paths::RootMeanSquare(paths.truth);
    result.outcome = Decide(result);
    return result;
  }

 private:
  // Pairs of the initial keyframes and of the frames in the window.
  std::vector<PosePair> PairsInWindow(const InitializationRecord& start, bool extended,
                                      InitializationResult* result) const {
    std::vector<PosePair> pairs;
    double reached_m = 0;
    for (const InitializationRecord::KeyFrame& keyframe : start.keyframes)
      AddPair(keyframe.time, keyframe.camera_from_map, &pairs, &reached_m);
    const Timestamp begin = run_.frames[start.frame].time;
    const double required_m = extended ? noise_m_ / options_.tolerance : 0;
    for (std::size_t i = start.frame; i < run_.frames.size(); ++i) {
      const FrameRecord& frame = run_.frames[i];
      const Timestamp since = frame.time - begin;
      if (since > options_.window && (since > options_.max_window || reached_m >= required_m)) break;
      if (!engine::HasPose(frame.state) || frame.map_key != start.map_key) continue;
      if (!AddPair(frame.time, frame.camera_from_map, &pairs, &reached_m)) continue;
      result->window_s = ToSeconds(since);
    }
    return pairs;
  }

  // Returns false when there is no truth. reached_m: largest distance of a true centre from the first one.
  bool AddPair(Timestamp time, const engine::Rigid3& camera_from_map, std::vector<PosePair>* pairs,
               double* reached_m) const {
    const auto pose = InterpolatePose(truth_, time, options_.max_time_difference);
    if (!pose) return false;
    pairs->push_back({camera_from_map.inverse(), *pose});
    const Eigen::Vector3d& first = pairs->front().truth_from_camera.translation;
    *reached_m = std::max(*reached_m, (pose->translation - first).norm());
    return true;
  }

  InitializationOutcome Decide(const InitializationResult& result) const {
    if (result.error_m > std::max(options_.tolerance * result.path_m, noise_m_))
      return InitializationOutcome::kFalsePath;
    if (result.depth_error && *result.depth_error > options_.tolerance)
      return InitializationOutcome::kFalseDepth;
    const double path_m = std::max(result.path_m, result.true_path_m);
    return path_m > 0 && path_m >= noise_m_ ? InitializationOutcome::kRight
                                            : InitializationOutcome::kUndecided;
  }

  const RunRecord& run_;
  const std::vector<TimedPose>& truth_;
  const TrueDepthSource& true_depths_;
  const FalseInitializationOptions& options_;
  const double noise_m_;
};

}  // namespace

std::optional<std::string> FalseInitializationOptions::Validate() const {
  if (window <= Timestamp{}) return "the window must be positive";
  if (max_window < window) return "the maximum window must not be shorter than the window";
  if (!(tolerance > 0 && tolerance < 1)) return "the tolerance must be between 0 and 1";
  if (!(sigmas >= 0)) return "the number of standard deviations must not be negative";
  if (min_points < 1) return "at least one point with a true depth must be required";
  if (!(truth_noise_m >= 0 && std::isfinite(truth_noise_m)))
    return "the noise of the truth must be finite and not negative";
  if (max_time_difference < Timestamp{}) return "the time difference to the truth must not be negative";
  return std::nullopt;
}

const char* ToString(InitializationOutcome outcome) {
  switch (outcome) {
    case InitializationOutcome::kRight:
      return "right";
    case InitializationOutcome::kFalsePath:
      return "false path";
    case InitializationOutcome::kFalseDepth:
      return "false depth";
    case InitializationOutcome::kUndecided:
      return "undecided";
  }
  return "undecided";
}

std::vector<InitializationResult> ClassifyInitializations(const RunRecord& run,
                                                          const std::vector<TimedPose>& truth,
                                                          const TrueDepthSource& true_depths,
                                                          const FalseInitializationOptions& options) {
  if (const auto fault = options.Validate())
    throw Error("Initializations cannot be classified: " + *fault + ".");
  std::vector<InitializationResult> results;
  if (truth.empty()) return results;
  const InitializationClassifier classifier(run, truth, true_depths, options);
  for (const InitializationRecord& start : run.initializations) results.push_back(classifier.Classify(start));
  return results;
}

}  // namespace docent::app
