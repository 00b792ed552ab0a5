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

double LargestDistance(const std::vector<Eigen::Vector3d>& points) {
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) largest = std::max(largest, (points[i] - points[j]).norm());
  }
  return largest;
}

// The scale and translation of least squares after the rotation of the orientations.
struct Fit {
  double scale = 0, error_m = 0, path_m = 0, true_path_m = 0, map_path = 0;
};

Fit FitCenters(const std::vector<Pair>& pairs) {
  const engine::Rotation3 truth_from_map = AlignRotations(pairs);
  std::vector<Eigen::Vector3d> truth, turned;
  Eigen::Vector3d truth_mean = Eigen::Vector3d::Zero(), turned_mean = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) {
    truth.push_back(pair.truth_from_camera.translation);
    turned.push_back(truth_from_map * pair.map_from_camera.translation);
    truth_mean += truth.back();
    turned_mean += turned.back();
  }
  truth_mean /= static_cast<double>(pairs.size());
  turned_mean /= static_cast<double>(pairs.size());
  double product = 0, square = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    product += (truth[i] - truth_mean).dot(turned[i] - turned_mean);
    square += (turned[i] - turned_mean).squaredNorm();
  }
  Fit fit;
  fit.scale = square > 0 ? std::max(0.0, product / square) : 0;
  double error = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    error += ((truth[i] - truth_mean) - fit.scale * (turned[i] - turned_mean)).squaredNorm();
  fit.error_m = std::sqrt(error / static_cast<double>(pairs.size()));
  fit.map_path = LargestDistance(turned);
  fit.path_m = fit.scale * fit.map_path;
  fit.true_path_m = LargestDistance(truth);
  return fit;
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class StartJudge {
 public:
  StartJudge(const RunRecord& run, const std::vector<TimedPose>& truth, const FalseStartOptions& options)
      : run_(run),
        truth_(truth),
        options_(options),
        noise_m_(options.truth_noise_m ? *options.truth_noise_m
                                       : EstimateTruthNoise(truth, run.frames, options.max_time_difference)) {
  }

  StartResult Judge(const StartRecord& start) const {
    StartResult result;
    result.map_key = start.map_key;
    result.frame = start.frame;
    for (const MapRecord& map : run_.maps) {
      if (map.key == start.map_key) result.discarded = map.discarded;
    }
    std::vector<Pair> pairs;
    for (const StartRecord::KeyFrame& keyframe : start.keyframes)
      AddPair(keyframe.time, keyframe.camera_from_map, &pairs);
    std::vector<double> depths;
    const Timestamp begin = run_.frames[start.frame].time;
    // What a tenth of the path must be for noise alone not to exceed it.
    const double needed_m = options_.noise_factor * noise_m_ / options_.tolerance;
    std::vector<Eigen::Vector3d> centers;
    double reached_m = 0;
    for (const Pair& pair : pairs) AddCenter(pair, &centers, &reached_m);
    for (std::size_t i = start.frame; i < run_.frames.size(); ++i) {
      const FrameRecord& frame = run_.frames[i];
      const Timestamp since = frame.time - begin;
      if (since > options_.window && (since > options_.longest || reached_m >= needed_m)) break;
      if (!engine::HasPose(frame.state) || frame.map_key != start.map_key) continue;
      if (!AddPair(frame.time, frame.camera_from_map, &pairs)) continue;
      AddCenter(pairs.back(), &centers, &reached_m);
      result.window_s = ToSeconds(since);
      if (frame.median_depth > 0) depths.push_back(frame.median_depth);
    }
    result.centers = static_cast<int>(pairs.size());
    if (pairs.size() >= 3) Decide(FitCenters(pairs), Median(std::move(depths)), needed_m, &result);
    return result;
  }

 private:
  bool AddPair(Timestamp time, const engine::Rigid3& camera_from_map, std::vector<Pair>* pairs) const {
    const auto pose = InterpolatePose(truth_, time, options_.max_time_difference);
    if (pose) pairs->push_back({camera_from_map.inverse(), *pose});
    return pose.has_value();
  }

  static void AddCenter(const Pair& pair, std::vector<Eigen::Vector3d>* centers, double* reached_m) {
    for (const Eigen::Vector3d& other : *centers)
      *reached_m = std::max(*reached_m, (pair.truth_from_camera.translation - other).norm());
    centers->push_back(pair.truth_from_camera.translation);
  }

  void Decide(const Fit& fit, double median_depth, double needed_m, StartResult* result) const {
    result->error_m = fit.error_m;
    result->path_m = fit.path_m;
    result->true_path_m = fit.true_path_m;
    if (median_depth > 0) {
      result->claimed_ratio = fit.map_path / median_depth;
      result->depth_m = fit.scale * median_depth;
    }
    const double noise_m = options_.noise_factor * noise_m_;
    if (fit.error_m > std::max(options_.tolerance * fit.path_m, noise_m)) {
      result->verdict = StartVerdict::kFalsePath;
      return;
    }
    // What the depth is at most: each end of the true path may be off by the noise.
    if (result->claimed_ratio > 0 &&
        (fit.true_path_m + 2 * noise_m) / result->claimed_ratio < options_.least_depth_m) {
      result->verdict = StartVerdict::kFalseDepth;
      return;
    }
    const bool above_noise = fit.true_path_m > 0 && fit.true_path_m >= needed_m;
    result->verdict = above_noise ? StartVerdict::kRight : StartVerdict::kUndecided;
  }

  const RunRecord& run_;
  const std::vector<TimedPose>& truth_;
  const FalseStartOptions& options_;
  const double noise_m_;
};

}  // namespace

std::optional<std::string> FalseStartOptions::Validate() const {
  if (window <= Timestamp{}) return "the window of a start must be positive";
  if (longest < window) return "the longest window of a start must not be below the usual one";
  if (!(tolerance > 0 && tolerance < 1)) return "the tolerance of a start must lie between 0 and 1";
  if (!(least_depth_m >= 0)) return "the least depth of a start must not be negative";
  if (!(noise_factor >= 0)) return "the noise factor of a start must not be negative";
  if (truth_noise_m && !(*truth_noise_m >= 0 && std::isfinite(*truth_noise_m)))
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

double EstimateTruthNoise(const std::vector<TimedPose>& truth, const std::vector<FrameRecord>& frames,
                          Timestamp max_time_difference) {
  std::vector<double> differences;
  std::vector<Eigen::Vector3d> run;  // of frames in a row that have a truth
  for (const FrameRecord& frame : frames) {
    const auto pose = InterpolatePose(truth, frame.time, max_time_difference);
    if (!pose) {
      run.clear();
      continue;
    }
    run.push_back(pose->translation);
    if (run.size() < 5) continue;
    const Eigen::Vector3d* const c = &run[run.size() - 5];
    const Eigen::Vector3d fourth = c[0] - 4 * c[1] + 6 * c[2] - 4 * c[3] + c[4];
    for (const double value : fourth) differences.push_back(std::abs(value));
  }
  constexpr double kSigmaOfMedian = 1.4826;  // of a normal distribution's absolute values
  return kSigmaOfMedian * Median(std::move(differences)) / std::sqrt(70.0);
}

std::vector<StartResult> JudgeStarts(const RunRecord& run, const std::vector<TimedPose>& truth,
                                     const FalseStartOptions& options) {
  if (const auto fault = options.Validate()) throw Error("A start cannot be judged: " + *fault + ".");
  std::vector<StartResult> results;
  if (truth.empty()) return results;
  const StartJudge judge(run, truth, options);
  for (const StartRecord& start : run.starts) results.push_back(judge.Judge(start));
  return results;
}

}  // namespace docent::app
