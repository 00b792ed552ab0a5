// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <vector>

#include "engine/mapping/bundle_adjustment.h"

namespace docent::engine {

// A concave loss rho of a squared residual s, and its slope. Concave means rho(s) >= s * slope(s), which the
// evaluation below relies upon.
struct RobustValue {
  double cost = 0;  // rho(s)
  double slope =
      1;  // rho'(s), the weight of iteratively reweighted least squares; 0 beyond Tukey's threshold
};
RobustValue EvaluateLoss(RobustLoss loss, double threshold, double squared_residual);
// What a measurement costs that cannot be projected: as much as any gross outlier, wherever it would fall.
double CostOfUnprojectable(RobustLoss loss, double threshold);

// Half the sum of the losses of such squared norms as BundleEvaluation::squared_norms().
double RobustCost(RobustLoss loss, double threshold, const std::vector<double>& squared_norms);

// Standard deviation per axis of two-dimensional residuals from the median of their squared norms;
// measurements that do not project (infinite) are left out. Zero without any.
double EstimateSigma(const std::vector<double>& squared_norms);

// Residuals and Jacobians of a whole bundle problem in one pass over plain arrays. Bundle adjustment's solver
// copies its blocks from here, which is several times faster than one function object for every measurement.
//
// The robust loss is part of the residuals: a measurement with residual r, Jacobian J and s = |r|^2 becomes
// sqrt(rho') r with Jacobian sqrt(rho') J, and rho - rho' s goes into a remainder without Jacobian. The sum
// of squares is then exactly the robust cost, its gradient exactly the robust cost's, and J^T J that of
// iteratively reweighted least squares. For the same reason all measurements of one point by fixed cameras
// condense into a triangular 3x3 system (a Cholesky factor of their normal equations), however many there
// are.
//
// Owned by one AdjustBundle call and used on its thread only. Reads the problem at construction only;
// poses and points live in the state vectors from then on. The camera models must outlive it.
class BundleEvaluation {
 public:
  static constexpr int kPoseSize = 7;  // qx qy qz qw tx ty tz of camera_from_map

  // A measurement by a free camera. Jacobians are row-major and, for the pose, with respect to a twist
  // (v, w) applied on the left of camera_from_map; the seventh column is zero.
  struct Pair {
    int camera = 0, point = 0;
    std::array<double, 2> residual{};
    std::array<double, 2 * kPoseSize> by_pose{};
    std::array<double, 2 * 3> by_point{};  // not filled for a fixed point
  };
  // All measurements of a free point by fixed cameras. The fourth row is the remainder; its Jacobian is zero.
  struct Condensed {
    int point = 0;
    std::array<double, 4> residual{};
    std::array<double, 4 * 3> by_point{};
  };

  BundleEvaluation(const BundleProblem& problem, RobustLoss loss, const std::atomic<bool>* interrupt);

  // Starts over with this robust threshold.
  void set_threshold(double threshold) {
    threshold_ = threshold;
    tightening_cost_ = 0;
  }
  // Goes on with a smaller threshold at the state of the last evaluation. What the cost loses there by the
  // change alone goes into the remainder for good, so that the cost stays continuous and a minimiser that
  // compares costs across the change is not deceived.
  void TightenThreshold(double threshold);
  double threshold() const { return threshold_; }

  // Evaluates at the present state. False when the interrupt came: then the outputs are not to be used.
  bool Evaluate(bool with_jacobians);
  // Brings squared_norms() up to date with the state and nothing else; never interrupted.
  void EvaluateNorms();
  bool interrupted() const { return interrupt_ != nullptr && interrupt_->load(std::memory_order_relaxed); }

  // Not fixed, and a start that is finite: what is no number stays so, and its measurements count as
  // outliers.
  bool is_camera_free(int camera) const { return free_cameras_[static_cast<std::size_t>(camera)] != 0; }
  bool is_point_free(int point) const { return free_points_[static_cast<std::size_t>(point)] != 0; }
  double* pose_state(int camera) { return &poses_[kPoseSize * static_cast<std::size_t>(camera)]; }
  double* point_state(int point) { return &points_[3 * static_cast<std::size_t>(point)]; }
  static void PackPose(const Rigid3& camera_from_map, double* pose);
  static Rigid3 UnpackPose(const double* pose);

  const std::vector<Pair>& pairs() const { return pairs_; }
  const std::vector<Condensed>& condensed() const { return condensed_; }
  // Square root of the part of the robust cost that stands in no pair's residual.
  double remainder() const { return remainder_; }
  // Squared norms of residual / sigma_px, infinite where a measurement does not project. In an order of this
  // class's own: entry i belongs to the problem's measurement measurement_index(i).
  const std::vector<double>& squared_norms() const { return squared_norms_; }
  int measurement_index(std::size_t i) const { return measurements_[i].index; }

 private:
  // A measurement as the passes want it: in the order in which they run.
  struct PackedMeasurement {
    Eigen::Vector2d pixel;
    double inverse_sigma = 1;
    int camera = 0, point = 0, index = 0;
  };
  struct CameraCache {
    const CameraModel* model = nullptr;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
  };
  // What one point's fixed cameras add up to before it is condensed.
  struct NormalEquations {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    double cost = 0;
  };

  void PackMeasurements(const BundleProblem& problem);
  void UpdateCameras();
  double CostOf(std::size_t measurement) const;
  // One residual (/ sigma_px) with the Jacobian d residual / d point_in_camera; false where nothing projects.
  bool Project(std::size_t measurement, Eigen::Vector3d* point_in_camera, Eigen::Vector2d* residual,
               Eigen::Matrix<double, 2, 3>* jacobian);
  void AddFixedCamera(std::size_t measurement, bool with_jacobians, NormalEquations* sum);
  void EvaluatePair(std::size_t measurement, bool with_jacobians, Pair* pair);
  static void Condense(const NormalEquations& sum, bool with_jacobians, Condensed* result);

  const RobustLoss loss_;
  const std::atomic<bool>* interrupt_;
  double threshold_ = 1;

  std::vector<double> poses_, points_;
  std::vector<char> free_cameras_, free_points_;
  std::vector<CameraCache> cameras_;
  // First those of neither a free camera nor a free point, whose norms alone are worked out; then the
  // condensed ones; then one for each pair. Within each part by ascending point.
  std::vector<PackedMeasurement> measurements_;
  std::vector<double> squared_norms_;
  std::size_t condensed_begin_ = 0, pairs_begin_ = 0;
  std::vector<std::size_t> condensed_ends_;  // one past each condensed point's last measurement
  std::vector<Pair> pairs_;
  std::vector<Condensed> condensed_;
  // Twice the costs: of all measurements that anything free depends on; of rho - rho' s over the pairs; of
  // all threshold changes so far.
  double cost_ = 0, loose_cost_ = 0, tightening_cost_ = 0;
  double remainder_ = 0;
};

}  // namespace docent::engine
