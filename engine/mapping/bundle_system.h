// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstddef>
#include <vector>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/robust_loss.h"
#include "engine/mapping/skyline_cholesky.h"

namespace docent::engine {

// The normal equations of a bundle problem and one damped step of them (Levenberg-Marquardt with the points
// eliminated: Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000, §6). Jacobians are never kept:
// a point's measurements are linearised, summed up and eliminated while they are in the cache, and linearised
// once more when the point follows the cameras' step. The measurements stay in the problem; memory is that
// of their residuals and of the reduced system of the cameras, and the work can stop after any point.
//
// The robust loss makes weights: a measurement with residual r (in sigmas) and slope rho'(|r|^2) counts as
// sqrt(rho') r, so the gradient is exactly the robust cost's, and the Hessian that of iteratively reweighted
// least squares.
//
// Owned by one AdjustBundle call and used on its thread only. The problem must outlive it, and keep its
// measurements; what else it holds is read at construction only.
class BundleSystem {
 public:
  BundleSystem(const BundleProblem& problem, RobustLoss loss, const std::atomic<bool>* interrupt);

  // Whether anything is free that anything was measured of.
  bool empty() const { return free_cameras_.empty() && free_points_.empty(); }
  bool interrupted() const { return interrupt_ != nullptr && interrupt_->load(std::memory_order_relaxed); }

  // Squared norms of residual / sigma_px at the state, infinite where a measurement does not project; entry i
  // belongs to the problem's measurement measurement_index(i). Right from construction on.
  const std::vector<double>& squared_norms() const { return squared_norms_; }
  // EstimateSigma of them, in the memory of next_squared_norms(), which are lost.
  double Sigma() { return EstimateSigma(squared_norms_, &next_squared_norms_); }
  // Those at the state that the problem has, in the memory of what the last step led to, which is lost.
  const std::vector<double>& MeasureAgain(const BundleProblem& problem);
  int measurement_index(std::size_t i) const { return order_[i]; }

  enum class Outcome { kDone, kSingular, kInterrupted };
  // Works out the step that minimises the weighted squares at this robust threshold plus damping times each
  // unknown's own curvature, and what it leads to. The state stays.
  Outcome Step(double threshold, double damping);
  // After a Step that is done: squared norms there, what half the weighted squares were to lose, and the
  // steepest slope of the robust cost before it.
  const std::vector<double>& next_squared_norms() const { return next_squared_norms_; }
  double predicted_decrease() const { return predicted_decrease_; }
  double steepest_slope() const { return steepest_slope_; }
  // Length of the step over that of the state.
  double relative_length() const { return relative_length_; }
  // Moves to where the last step leads.
  void Accept();

  // The step itself: twists on the left of camera_from_map by the order of free_cameras(), moves of points by
  // that of free_points(). Both lists hold indices into the problem, ascending.
  const std::vector<int>& free_cameras() const { return free_cameras_; }
  const std::vector<int>& free_points() const { return free_points_; }
  const Eigen::VectorXd& camera_step() const { return camera_step_; }
  Eigen::Vector3d PointStep(std::size_t i) const;

  void WriteBack(BundleProblem* problem) const;

 private:
  using Measurement = BundleProblem::Measurement;
  struct Camera {
    const CameraModel* model = nullptr;
    Rigid3 camera_from_map;
    Eigen::Matrix3d rotation;
    int unknown = -1;  // place among the free cameras
  };
  struct Point {
    std::size_t begin = 0, end = 0;  // of its measurements, in order_
    int index = 0;                   // into the problem
    int unknown = -1;                // place among the free points
  };
  // What of an eliminated point its own step needs.
  struct Eliminated {
    Eigen::Matrix3d inverse_hessian;
    Eigen::Vector3d gradient, damping;
  };
  // Of one measurement by a free camera: camera-point block of the Hessian, and that times the point's
  // inverse.
  struct Coupling {
    int camera = 0;  // place among the free ones
    Eigen::Matrix<double, 6, 3> block, solved;
  };
  struct Linearized {
    Eigen::Vector3d in_camera;
    Eigen::Vector2d residual;              // times the root of the weight
    Eigen::Matrix<double, 2, 3> jacobian;  // by the point in the camera, times the same
  };

  void Pack(const BundleProblem& problem);
  const Measurement& MeasurementAt(std::size_t i) const {
    return measurements_[static_cast<std::size_t>(order_[i])];
  }
  SkylineCholesky MakeReduced() const;
  // False where the measurement has no weight.
  bool Linearize(const Measurement& measurement, double squared_norm, const Eigen::Vector3d& point,
                 double threshold, Linearized* result) const;
  double SquaredNorm(const Measurement& measurement, const Camera& camera,
                     const Eigen::Vector3d& point) const;
  bool Reduce(double threshold, double damping);
  void ReducePoint(const Point& point, double threshold, double damping);
  void Eliminate(const Point& point, double damping, const Eigen::Matrix3d& hessian,
                 const Eigen::Vector3d& gradient);
  bool Follow(double threshold);
  void FollowPoint(const Point& point, double threshold);

  const RobustLoss loss_;
  const std::atomic<bool>* interrupt_;

  std::vector<Camera> cameras_, next_cameras_;
  std::vector<Eigen::Vector3d> positions_, next_positions_;  // of the problem's points
  std::vector<Point> points_;
  const std::vector<Measurement>& measurements_;  // the problem's
  std::vector<int> order_;                        // of the passes: indices of measurements, by point
  std::vector<double> squared_norms_, next_squared_norms_;
  std::vector<int> free_cameras_, free_points_;

  SkylineCholesky reduced_;
  Eigen::VectorXd camera_gradient_, camera_damping_, right_side_, camera_step_;
  std::vector<Eliminated> eliminated_;
  std::vector<Coupling> couplings_;  // of the point in hand
  double predicted_decrease_ = 0, steepest_slope_ = 0, relative_length_ = 0;
};

}  // namespace docent::engine
