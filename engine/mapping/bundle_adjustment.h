// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// Robust non-linear refinement of keyframe poses and points (ptamm §2.3, eq. 4-7).
namespace docent::engine {

enum class RobustLoss { kHuber, kTukey };

// A problem in structure-of-arrays form; indices refer to the vectors of the same struct.
struct BundleProblem {
  struct Camera {
    std::shared_ptr<const CameraModel> model;
    Rigid3 camera_from_map;  // in: start; out: result
    bool fixed = false;
  };
  struct Point {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  // in: start; out: result (finite points only)
    bool fixed = false;
  };
  struct Measurement {
    int camera = 0, point = 0;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
    float sigma_px = 1;                               // 2^level
    bool outlier = false;                             // out: residual beyond the robust threshold
  };
  std::vector<Camera> cameras;
  std::vector<Point> points;
  // In any order; by ascending point they are gone through as they lie in memory.
  std::vector<Measurement> measurements;
};

struct BundleOptions {
  RobustLoss loss = RobustLoss::kTukey;  // ptamm §2.3
  int max_iterations = 10;
  // The robust threshold sigma_T is this factor times a robust estimate (median absolute deviation) of the
  // normalised residuals' standard deviation, never below min_sigma. 4.685 is Tukey's 95 % efficiency.
  double threshold_factor = 4.685;
  double min_sigma = 0.4;
  // Stops when this becomes true, which is looked at every few points and before each product of panels; what
  // was reached is kept when it is better than the start. May be null.
  const std::atomic<bool>* interrupt = nullptr;
};

// What happened, as data.
struct BundleSummary {
  enum class Outcome { kConverged, kIterationLimit, kInterrupted, kFailed };
  Outcome outcome = Outcome::kFailed;
  // Half the sums of the robust losses of all measurements, both under the threshold that was reached last;
  // final_cost <= initial_cost always.
  double initial_cost = 0, final_cost = 0;
  double sigma = 0;  // of the normalised residuals along one axis, after
  int iterations = 0;
  int outliers = 0;
  double seconds = 0;
  std::string Brief() const;
};

// Adjusts the free cameras and points in place. At least one camera should be fixed (two, or a fixed point,
// to hold the scale); the gauge is otherwise held by Levenberg-Marquardt's damping. A measurement whose point
// is behind its camera counts as an outlier, as does one of a point or camera that is not finite (which then
// stays as it is). Indices must be valid and models not null. Deterministic: single-threaded, same input,
// same result.
BundleSummary AdjustBundle(const BundleOptions& options, BundleProblem* problem);

}  // namespace docent::engine
