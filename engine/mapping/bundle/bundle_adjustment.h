// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// Robust non-linear refinement of keyframe poses and point positions (ptamm §2.3, eq. 4-7).
namespace docent::engine {

enum class RobustLoss { kHuber, kTukey };

// A bundle adjustment problem as flat arrays; every index refers to the vectors of the same struct.
struct BundleProblem {
  struct Camera {
    std::shared_ptr<const CameraModel> model;
    Rigid3 camera_from_map;  // in: initial value; out: result
    bool fixed = false;
  };
  struct Point {
    // In: initial value; out: result (finite points only).
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    bool fixed = false;
  };
  struct Measurement {
    int camera = 0, point = 0;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
    float sigma_px = 1;                               // standard deviation: 2^level of the observation
    bool outlier = false;                             // out: the residual exceeds the robust threshold
  };
  std::vector<Camera> cameras;
  std::vector<Point> points;
  // In any order. Measurements that are sorted by point are read in the order in which they lie in memory.
  std::vector<Measurement> measurements;
};

struct BundleOptions {
  RobustLoss loss = RobustLoss::kTukey;  // ptamm §2.3
  int max_iterations = 10;
  // The robust threshold sigma_T is this factor times a robust estimate (median absolute deviation) of the
  // normalized residuals' standard deviation, never below min_sigma. 4.685 is Tukey's 95 % efficiency.
  double threshold_factor = 4.685;
  double min_sigma = 0.4;
  // The adjustment stops once this becomes true; it is read every few points and before each product of
  // panels. The state that was reached is kept if its cost is lower than that of the initial state. May be
  // null.
  const std::atomic<bool>* interrupt = nullptr;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The result of an adjustment as figures, for logs and decisions.
struct BundleSummary {
  // kFailed: nothing was adjusted, because the keyframe in question does not exist (AdjustLocally).
  enum class Outcome { kConverged, kIterationLimit, kInterrupted, kFailed };
  Outcome outcome = Outcome::kFailed;
  // Half the sum of the robust losses of all measurements. Both costs use the threshold that was reached
  // last; final_cost <= initial_cost always.
  double initial_cost = 0, final_cost = 0;
  double sigma = 0;  // of the normalized residuals along one axis, at the final state
  int iterations = 0;
  int outliers = 0;
  double seconds = 0;
};

// Adjusts the free cameras and points in place. At least one camera should be fixed, and a second camera or a
// point to fix the scale; otherwise only the damping of Levenberg-Marquardt fixes the gauge. A measurement
// counts as an outlier if its point is behind the camera, or if its point or camera is not finite (such a
// camera or point is left unchanged). It never fails: what it cannot improve stays as it is. Indices must be
// valid and models not null. Single-threaded and deterministic: equal input gives an equal result.
BundleSummary AdjustBundle(const BundleOptions& options, BundleProblem* problem);

}  // namespace docent::engine
