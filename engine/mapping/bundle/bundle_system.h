// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstddef>
#include <vector>

#include "engine/mapping/bundle/bundle_adjustment.h"
#include "engine/mapping/bundle/robust_loss.h"
#include "engine/mapping/bundle/skyline_cholesky.h"

namespace docent::engine {

// The normal equations of a bundle problem, and one damped step that solves them: Levenberg-Marquardt with
// the points eliminated (Schur complement; Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000,
// §6). Jacobians are not stored: the measurements of a point are linearised, summed and eliminated while they
// are in the cache, and linearised once more for the back-substitution of the point. The measurements stay in
// the problem, so the memory is that of their residuals and of the reduced camera system. The work can be
// interrupted after any few points.
//
// The robust loss acts through weights: a measurement with residual r (in sigmas) and slope rho'(|r|^2)
// counts as sqrt(rho') r. The gradient is then exactly that of the robust cost, and the Hessian is that of
// iteratively reweighted least squares.
//
// Owned by one AdjustBundle call and used on its thread only. The problem must outlive this object and must
// keep its measurements unchanged; everything else in it is read during construction only.
class BundleSystem {
 public:
  BundleSystem(const BundleProblem& problem, RobustLoss loss, const std::atomic<bool>* interrupt);

  // True if no camera or point with measurements is free.
  bool empty() const { return free_cameras_.empty() && free_points_.empty(); }
  bool interrupted() const { return interrupt_ != nullptr && interrupt_->load(std::memory_order_relaxed); }

  // Squared norms of residual / sigma_px at the current state; infinite for a measurement that does not
  // project. Entry i belongs to the problem's measurement measurement_index(i). Valid from construction on.
  const std::vector<double>& squared_norms() const { return squared_norms_; }
  // EstimateSigma of squared_norms(). Uses the memory of next_squared_norms(), whose values are lost.
  double Sigma() { return EstimateSigma(squared_norms_, &next_squared_norms_); }
  // Squared norms at the state that `problem` holds. Uses the memory of next_squared_norms(), whose values
  // are lost.
  const std::vector<double>& EvaluateAt(const BundleProblem& problem);
  int measurement_index(std::size_t i) const { return order_[i]; }

  enum class Outcome { kDone, kSingular, kInterrupted };
  // Computes the step that minimizes the weighted squares at this robust threshold plus `damping` times the
  // diagonal of the Hessian, and evaluates the state after it. The current state does not change.
  Outcome Step(double threshold, double damping);
  // Valid after a Step that returned kDone: the squared norms after the step, the decrease of half the
  // weighted squares that the quadratic model predicts, and the largest component of the gradient before the
  // step.
  const std::vector<double>& next_squared_norms() const { return next_squared_norms_; }
  double predicted_decrease() const { return predicted_decrease_; }
  double max_gradient() const { return max_gradient_; }
  // Length of the step divided by the length of the state.
  double relative_length() const { return relative_length_; }
  // Makes the state after the last step the current one.
  void Accept();

  // What is free: ascending indices into the problem.
  const std::vector<int>& free_cameras() const { return free_cameras_; }
  const std::vector<int>& free_points() const { return free_points_; }
  // The step itself: twists that are applied on the left of camera_from_map, in the order of free_cameras().
  const Eigen::VectorXd& camera_step() const { return camera_step_; }

  void WriteBack(BundleProblem* problem) const;

 private:
  using Measurement = BundleProblem::Measurement;
  struct Camera {
    const CameraModel* model = nullptr;
    Rigid3 camera_from_map;
    Eigen::Matrix3d rotation;
    int unknown = -1;  // index among the free cameras; -1 if fixed
  };
  struct Point {
    std::size_t begin = 0, end = 0;  // range of its measurements in order_
    int index = 0;                   // into the problem's points
    int unknown = -1;                // index among the free points; -1 if fixed
  };
  // The terms of an eliminated point that its back-substitution needs.
  struct Eliminated {
    Eigen::Matrix3d inverse_hessian;
    Eigen::Vector3d gradient, damping;
  };
  // For one measurement by a free camera: the camera-point block of the Hessian, and its product with the
  // inverse of the point's Hessian.
  struct Coupling {
    int camera = 0;  // index among the free cameras
    Eigen::Matrix<double, 6, 3> block, solved;
  };
  struct Linearized {
    Eigen::Vector3d in_camera;
    // Both are scaled with the square root of the weight; the derivative is by the point in the camera frame.
    Eigen::Vector2d residual;
    Eigen::Matrix<double, 2, 3> jacobian;
  };

  void Pack(const BundleProblem& problem);
  const Measurement& MeasurementAt(std::size_t i) const {
    return measurements_[static_cast<std::size_t>(order_[i])];
  }
  SkylineCholesky MakeReduced() const;
  // Returns false if the measurement has no weight.
  bool Linearize(const Measurement& measurement, double squared_norm, const Eigen::Vector3d& point,
                 double threshold, Linearized* result) const;
  double SquaredNorm(const Measurement& measurement, const Camera& camera,
                     const Eigen::Vector3d& point) const;
  bool Reduce(double threshold, double damping);
  void ReducePoint(const Point& point, double threshold, double damping);
  void Eliminate(const Point& point, double damping, const Eigen::Matrix3d& hessian,
                 const Eigen::Vector3d& gradient);
  bool BackSubstitute(double threshold);
  void BackSubstitutePoint(const Point& point, double threshold);

  const RobustLoss loss_;
  const std::atomic<bool>* interrupt_;

  std::vector<Camera> cameras_, next_cameras_;
  std::vector<Eigen::Vector3d> positions_, next_positions_;  // of the problem's points, in the same order
  std::vector<Point> points_;
  const std::vector<Measurement>& measurements_;  // belong to the problem
  std::vector<int> order_;                        // indices of measurements, sorted by point
  std::vector<double> squared_norms_, next_squared_norms_;
  std::vector<int> free_cameras_, free_points_;

  SkylineCholesky reduced_;
  Eigen::VectorXd camera_gradient_, camera_damping_, right_hand_side_, camera_step_;
  std::vector<Eliminated> eliminated_;
  std::vector<Coupling> couplings_;  // of the point that is being eliminated
  double predicted_decrease_ = 0, max_gradient_ = 0, relative_length_ = 0;
};

}  // namespace docent::engine
