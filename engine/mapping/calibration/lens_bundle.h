// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "engine/mapping/bundle/robust_loss.h"
#include "engine/mapping/calibration/self_calibration.h"

namespace docent::engine {

// The parameters of an unknown lens, in this order: the logarithm of the focal length, k1, k2, and the
// principal point in pixels.
struct LensParameters {
  static constexpr int kCount = 5;
  using Vector = Eigen::Matrix<double, kCount, 1>;

  double log_focal() const { return values[0]; }
  double focal() const { return std::exp(values[0]); }
  double k1() const { return values[1]; }
  double k2() const { return values[2]; }
  double cx() const { return values[3]; }
  double cy() const { return values[4]; }
  CameraModel Model(int width_px, int height_px) const;

  Vector values = Vector::Zero();
};

// What a self-calibration changes: poses, points, and the lens that the unknown cameras share.
struct LensBundleState {
  std::vector<Rigid3> poses;  // camera_from_map
  std::vector<Eigen::Vector3d> points;
  LensParameters lens;
};

// The normal equations of a bundle problem whose cameras share an unknown lens: unknown are the free cameras,
// with six entries each, and then the lens; the points are eliminated (Schur complement). Measurements are
// counted by point; `norms` are their squared residuals in that order, infinite for a point that does not
// project. The lens has priors apart from its focal length. Borrows its arguments; on one thread only.
class LensBundle {
 public:
  LensBundle(const SelfCalibrationOptions& options, const std::vector<char>& unknown,
             const BundleProblem& problem);

  bool HasUnknownCamera() const { return first_unknown_ >= 0; }
  bool IsUnknown(std::size_t camera) const { return unknown_[camera] != 0; }
  // Size of the images of the unknown cameras.
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // The state of the problem, and the expected values of all lens parameters but the focal length.
  const LensBundleState& begin() const { return begin_state_; }
  const LensParameters::Vector& expected() const { return expected_; }

  std::size_t size() const { return order_.size(); }  // number of measurements
  std::size_t measurement_index(std::size_t i) const { return order_[i]; }
  const BundleProblem::Measurement& At(std::size_t i) const { return problem_.measurements[order_[i]]; }
  // The measurements of a point are those from FirstOf(point) to before FirstOf(point + 1).
  std::size_t FirstOf(std::size_t point) const { return first_of_point_[point]; }
  const std::vector<std::size_t>& free_cameras() const { return free_; }
  // The index of a camera in free_cameras(), or -1.
  int FreeIndex(std::size_t camera) const { return free_index_[camera]; }
  // The first camera that does not move.
  std::size_t anchor() const { return static_cast<std::size_t>(anchor_ < 0 ? 0 : anchor_); }

  // A measurement linearized at a state, divided by its sigma.
  struct Linearized {
    Eigen::Vector2d residual;
    Eigen::Matrix<double, 2, 6> by_pose;
    Eigen::Matrix<double, 2, 3> by_point;
    Eigen::Matrix<double, 2, LensParameters::kCount> by_lens;
  };
  // Returns false if the point cannot be projected.
  bool Residual(const LensBundleState& state, const BundleProblem::Measurement& measurement, Linearized* out,
                bool jacobians) const;
  // The weight of the measurement, linearized with its derivatives; 0 if it has none.
  double LinearizeWeighted(const LensBundleState& state, double norm, RobustLoss loss, double threshold,
                           const BundleProblem::Measurement& measurement, Linearized* out) const;
  std::vector<double> Norms(const LensBundleState& state) const;
  // Half the squared residuals of the priors.
  double PriorCost(const LensParameters& lens) const;

  struct Reduced {
    Eigen::MatrixXd matrix;    // lower triangle
    Eigen::VectorXd gradient;  // after elimination
    std::vector<Eigen::Matrix3d> inverse;
    std::vector<Eigen::Vector3d> point_gradient;
  };
  void Linearize(const LensBundleState& state, const std::vector<double>& norms, RobustLoss loss,
                 double threshold, double damping, Reduced* out);
  // The state after a step of cameras and lens, with the points by back substitution.
  LensBundleState Step(const LensBundleState& state, const std::vector<double>& norms, RobustLoss loss,
                       double threshold, const Reduced& reduced, const Eigen::VectorXd& step) const;

 private:
  using LensCoupling = Eigen::Matrix<double, LensParameters::kCount, 3>;
  struct Seen {
    int at = -1;  // index of the camera in free_
    Eigen::Matrix<double, 6, 3> coupling;
  };
  // The equations of one point before its elimination; the couplings with cameras are in seen_.
  struct PointEquations {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    LensCoupling lens_coupling = LensCoupling::Zero();
  };

  void Pack();
  bool ProjectUnknown(const LensParameters& lens, const Eigen::Vector3d& in_camera, Eigen::Vector2d* pixel,
                      Eigen::Matrix<double, 2, 3>* by_camera, Linearized* out) const;
  // Adds a linearized measurement to the equations of its point, its camera and the lens.
  void Add(const Linearized& linearized, double weight, std::size_t camera, PointEquations* point,
           Reduced* out);
  void Eliminate(std::size_t point, double damping, PointEquations* equations, Reduced* out);
  void AddPriors(const LensParameters& lens, Reduced* out) const;
  Eigen::Index lens_at() const { return static_cast<Eigen::Index>(6 * free_.size()); }

  const SelfCalibrationOptions& options_;
  const BundleProblem& problem_;
  const std::vector<char>& unknown_;
  int first_unknown_ = -1, anchor_ = -1;
  int width_px_ = 0, height_px_ = 0;
  // A prior sigma of 0: not estimated.
  LensParameters::Vector prior_ = LensParameters::Vector::Zero(), expected_ = LensParameters::Vector::Zero();
  LensBundleState begin_state_;
  std::vector<std::size_t> order_, first_of_point_;  // measurements by point
  std::vector<int> free_index_;                      // of each camera
  std::vector<std::size_t> free_;
  std::vector<Seen> seen_;  // scratch memory
};

}  // namespace docent::engine
