// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/false_start.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace docent::app {

namespace {

// A pose of the map and what it truly was.
struct Pair {
  engine::Rigid3 map_from_camera, truth_from_camera;
};

// As in EvaluateRun: Hartley et al., "Rotation Averaging", 2013, section 5.3.
engine::Rotation3 AlignRotations(const std::vector<Pair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pairs)
    sum += (pair.truth_from_camera.rotation * pair.map_from_camera.rotation.inverse()).matrix();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;
  return engine::Rotation3(Eigen::Matrix3d(u * svd.matrixV().transpose()));
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Centres about their means, those of the map turned into the truth's axes.
struct Paths {
  std::vector<Eigen::Vector3d> truth, map;

  explicit Paths(const std::vector<Pair>& pairs) {
    const engine::Rotation3 truth_from_map = AlignRotations(pairs);
    for (const Pair& pair : pairs) {
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

  // Of least squares, not negative.
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

// What the true depths say of the map's scale, metres a unit.
struct DepthComparison {
  int points = 0;               // that could be followed
  double inverse = 0;           // 1 / scale
  double sigma = 0;             // of `inverse`
  std::optional<double> error;  // relative, of the depths among each other
};

// The median over the better known half of the points: those that were followed for long, and so seen from
// far apart. The error of what is common to all of them is not smaller than each one's.
DepthComparison CompareDepths(const StartRecord& start, const TrueDepthSource& true_depths,
                              const FalseStartOptions& options) {
  DepthComparison comparison;
  if (!true_depths) return comparison;
  const TrueDepths depths = true_depths(start);
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < start.points.size() && i < depths.size(); ++i) {
    if (depths[i] && start.points[i].depth > 0) known.push_back(i);
  }
  comparison.points = static_cast<int>(known.size());
  if (known.size() < options.least_points) return comparison;
  // Not by what the map told of them, which may be false.
  std::stable_sort(known.begin(), known.end(),
                   [&depths](std::size_t a, std::size_t b) { return depths[a]->sigma < depths[b]->sigma; });
  known.resize(std::max(options.least_points, known.size() / 2));
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

class StartJudge {
 public:
  StartJudge(const RunRecord& run, const std::vector<TimedPose>& truth, const TrueDepthSource& true_depths,
             const FalseStartOptions& options)
      : run_(run),
        truth_(truth),
        true_depths_(true_depths),
        options_(options),
        noise_m_(options.sigmas * options.truth_noise_m) {}

  StartResult Judge(const StartRecord& start) const {
    StartResult result;
    result.map_key = start.map_key;
    result.frame = start.frame;
    for (const MapRecord& map : run_.maps) {
      if (map.key == start.map_key) result.discarded = map.discarded;
    }
    const DepthComparison depth = CompareDepths(start, true_depths_, options_);
    result.depth_points = depth.points;
    result.depth_error = depth.error;
    const bool bounded = static_cast<std::size_t>(depth.points) >= options_.least_points;
    const std::vector<Pair> pairs = FirstSecond(start, !bounded, &result);
    result.centers = static_cast<int>(pairs.size());
    if (pairs.size() < 3) return result;
    const Paths paths(pairs);
    const double told = run_.frames[start.frame].median_depth;
    double scale = paths.Scale();
    if (bounded) {
      const double margin = options_.sigmas * depth.sigma;
      const double most_inverse = depth.inverse + margin, least_inverse = depth.inverse - margin;
      if (most_inverse > 0) {
        scale = std::max(scale, 1 / most_inverse);
        result.least_depth_m = told / most_inverse;
      }
      if (least_inverse > 0) {
        scale = std::min(scale, 1 / least_inverse);
        result.most_depth_m = told / least_inverse;
      }
    }
    if (told > 0) result.depth_m = scale * told;
    result.error_m = paths.Error(scale);
    result.path_m = scale * Paths::RootMeanSquare(paths.map);
    result.true_path_m = Paths::RootMeanSquare(paths.truth);
    result.verdict = Decide(result);
    return result;
  }

 private:
  // Of the map's first second with depth.
  std::vector<Pair> FirstSecond(const StartRecord& start, bool extended, StartResult* result) const {
    std::vector<Pair> pairs;
    double reached_m = 0;
    for (const StartRecord::KeyFrame& keyframe : start.keyframes)
      AddPair(keyframe.time, keyframe.camera_from_map, &pairs, &reached_m);
    const Timestamp begin = run_.frames[start.frame].time;
    const double enough_m = extended ? noise_m_ / options_.tolerance : 0;
    for (std::size_t i = start.frame; i < run_.frames.size(); ++i) {
      const FrameRecord& frame = run_.frames[i];
      const Timestamp since = frame.time - begin;
      if (since > options_.window && (since > options_.longest || reached_m >= enough_m)) break;
      if (!engine::HasPose(frame.state) || frame.map_key != start.map_key) continue;
      if (!AddPair(frame.time, frame.camera_from_map, &pairs, &reached_m)) continue;
      result->window_s = ToSeconds(since);
    }
    return pairs;
  }

  // False where there is no truth. reached_m: how far the true centres are from the first one.
  bool AddPair(Timestamp time, const engine::Rigid3& camera_from_map, std::vector<Pair>* pairs,
               double* reached_m) const {
    const auto pose = InterpolatePose(truth_, time, options_.max_time_difference);
    if (!pose) return false;
    pairs->push_back({camera_from_map.inverse(), *pose});
    const Eigen::Vector3d& first = pairs->front().truth_from_camera.translation;
    *reached_m = std::max(*reached_m, (pose->translation - first).norm());
    return true;
  }

  StartVerdict Decide(const StartResult& result) const {
    if (result.error_m > std::max(options_.tolerance * result.path_m, noise_m_))
      return StartVerdict::kFalsePath;
    if (result.depth_error && *result.depth_error > options_.tolerance) return StartVerdict::kFalseDepth;
    const double path_m = std::max(result.path_m, result.true_path_m);
    return path_m > 0 && path_m >= noise_m_ ? StartVerdict::kRight : StartVerdict::kUndecided;
  }

  const RunRecord& run_;
  const std::vector<TimedPose>& truth_;
  const TrueDepthSource& true_depths_;
  const FalseStartOptions& options_;
  const double noise_m_;
};

}  // namespace

std::optional<std::string> FalseStartOptions::Validate() const {
  if (window <= Timestamp{}) return "the window of a start must be positive";
  if (longest < window) return "the longest window of a start must not be below the usual one";
  if (!(tolerance > 0 && tolerance < 1)) return "the tolerance of a start must lie between 0 and 1";
  if (!(sigmas >= 0)) return "the standard deviations that are allowed must not be negative";
  if (least_points < 1) return "at least one point with a true depth must be asked for";
  if (!(truth_noise_m >= 0 && std::isfinite(truth_noise_m)))
    return "the noise of the truth must not be negative";
  if (max_time_difference < Timestamp{}) return "the time difference to the truth must not be negative";
  return std::nullopt;
}

const char* ToString(StartVerdict verdict) {
  switch (verdict) {
    case StartVerdict::kRight:
      return "right";
    case StartVerdict::kFalsePath:
      return "false path";
    case StartVerdict::kFalseDepth:
      return "false depth";
    case StartVerdict::kUndecided:
      return "undecided";
  }
  return "undecided";
}

std::vector<StartResult> JudgeStarts(const RunRecord& run, const std::vector<TimedPose>& truth,
                                     const TrueDepthSource& true_depths, const FalseStartOptions& options) {
  if (const auto fault = options.Validate()) throw Error("A start cannot be judged: " + *fault + ".");
  std::vector<StartResult> results;
  if (truth.empty()) return results;
  const StartJudge judge(run, truth, true_depths, options);
  for (const StartRecord& start : run.starts) results.push_back(judge.Judge(start));
  return results;
}

}  // namespace docent::app
