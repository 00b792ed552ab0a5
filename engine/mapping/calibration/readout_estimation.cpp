// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/readout_estimation.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/option_check.h"
#include "engine/mapping/bundle/robust_loss.h"

namespace docent::engine {

namespace {

// 95 % efficiency under Gaussian noise, and the smallest standard deviation, as in BundleOptions.
constexpr double kReadoutLossFactor = 1.345, kMinReadoutSigma = 0.4;
// Relative to the diagonal: determines what the problem leaves free, such as its scale.
constexpr double kReadoutDamping = 1e-7;

struct Linearized {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix2d by_readout;
};

class ReadoutProblem {
 public:
  ReadoutProblem(const std::vector<char>& of_lens, const BundleProblem& problem)
      : of_lens_(of_lens),
        problem_(problem),
        by_point_(problem.points.size()),
        free_(problem.cameras.size(), -1) {
    for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
      if (!problem.cameras[i].fixed) free_[i] = free_count_++;
    }
    for (std::size_t i = 0; i < problem.measurements.size(); ++i)
      by_point_[static_cast<std::size_t>(problem.measurements[i].point)].push_back(i);
  }

  double Sigma() {
    norms_.resize(problem_.measurements.size());
    Linearized linearized;
    for (std::size_t i = 0; i < norms_.size(); ++i) {
      norms_[i] = Linearize(problem_.measurements[i], &linearized) ? linearized.residual.squaredNorm()
                                                                   : std::numeric_limits<double>::infinity();
    }
    return std::max(kMinReadoutSigma, EstimateSigma(norms_));
  }

  // The normal equations of the readout time with cameras and points eliminated.
  bool Reduce(double sigma, Eigen::Matrix2d* information, Eigen::Vector2d* gradient) {
    const Eigen::Index size = 6 * free_count_ + 2;
    matrix_.setZero(size, size);
    gradient_.setZero(size);
    for (const std::vector<std::size_t>& measurements : by_point_)
      AddPoint(measurements, kReadoutLossFactor * sigma);
    const Eigen::Index cameras = size - 2;
    matrix_.diagonal().head(cameras) *= 1 + kReadoutDamping;
    *information = matrix_.bottomRightCorner<2, 2>();
    *gradient = gradient_.tail<2>();
    if (cameras == 0) return true;
    const Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower> factored(matrix_.topLeftCorner(cameras, cameras));
    if (factored.info() != Eigen::Success || !factored.isPositive()) return false;
    const Eigen::MatrixXd coupling = matrix_.bottomLeftCorner(2, cameras).transpose();
    const Eigen::MatrixXd solved = factored.solve(coupling);
    *information -= coupling.transpose() * solved;
    *gradient -= solved.transpose() * gradient_.head(cameras);
    return information->allFinite() && gradient->allFinite();
  }

 private:
  struct Seen {
    Eigen::Index at;
    Eigen::Matrix<double, 6, 3> coupling;
  };

  bool Linearize(const BundleProblem::Measurement& measurement, Linearized* out) const {
    const auto c = static_cast<std::size_t>(measurement.camera);
    const BundleProblem::Camera& camera = problem_.cameras[c];
    const Eigen::Vector3d x =
        camera.camera_from_map * problem_.points[static_cast<std::size_t>(measurement.point)].position;
    const Eigen::Vector2d measured = measurement.pixel.cast<double>();
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> by_camera;
    if (!camera.model->ProjectAtExposureOf(measured, x, &pixel, &by_camera)) return false;
    const double scale = 1 / static_cast<double>(measurement.sigma_px);
    out->residual = scale * (pixel - measured);
    by_camera *= scale;
    out->by_pose.leftCols<3>() = by_camera;
    out->by_pose.rightCols<3>() = -by_camera * Hat(x);
    out->by_point = by_camera * camera.camera_from_map.rotation.matrix();
    out->by_readout.setZero();
    if (of_lens_[c]) {
      const Eigen::Vector2d per_second = by_camera * camera.model->readout_motion().rotation_rate.cross(x);
      out->by_readout = per_second * camera.model->ReadoutPosition(measured).transpose();
    }
    return out->residual.allFinite();
  }

  void AddPoint(const std::vector<std::size_t>& measurements, double threshold) {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 2, 3> readout_coupling = Eigen::Matrix<double, 2, 3>::Zero();
    seen_.clear();
    const Eigen::Index readout_at = matrix_.rows() - 2;
    Linearized m;
    for (const std::size_t i : measurements) {
      if (!std::isfinite(norms_[i]) || !Linearize(problem_.measurements[i], &m)) continue;
      const double weight = EvaluateLoss(RobustLoss::kHuber, threshold, norms_[i]).slope;
      hessian.noalias() += weight * m.by_point.transpose() * m.by_point;
      gradient.noalias() += weight * m.by_point.transpose() * m.residual;
      readout_coupling.noalias() += weight * m.by_readout.transpose() * m.by_point;
      matrix_.bottomRightCorner<2, 2>().noalias() += weight * m.by_readout.transpose() * m.by_readout;
      gradient_.tail<2>().noalias() += weight * m.by_readout.transpose() * m.residual;
      const int free = free_[static_cast<std::size_t>(problem_.measurements[i].camera)];
      if (free < 0) continue;
      const Eigen::Index row = 6 * free;
      matrix_.block<6, 6>(row, row).noalias() += weight * m.by_pose.transpose() * m.by_pose;
      matrix_.block<2, 6>(readout_at, row).noalias() += weight * m.by_readout.transpose() * m.by_pose;
      gradient_.segment<6>(row).noalias() += weight * m.by_pose.transpose() * m.residual;
      seen_.push_back({row, weight * m.by_pose.transpose() * m.by_point});
    }
    if (!(hessian.trace() > 0)) return;
    hessian.diagonal() *= 1 + kReadoutDamping;
    const Eigen::Matrix3d inverse = hessian.inverse();
    const Eigen::Matrix<double, 2, 3> readout_solved = readout_coupling * inverse;
    matrix_.bottomRightCorner<2, 2>().noalias() -= readout_solved * readout_coupling.transpose();
    gradient_.tail<2>().noalias() -= readout_solved * gradient;
    for (const Seen& a : seen_) {
      const Eigen::Matrix<double, 6, 3> solved = a.coupling * inverse;
      gradient_.segment<6>(a.at).noalias() -= solved * gradient;
      matrix_.block<2, 6>(readout_at, a.at).noalias() -= readout_solved * a.coupling.transpose();
      for (const Seen& b : seen_) {
        if (b.at <= a.at) matrix_.block<6, 6>(a.at, b.at).noalias() -= solved * b.coupling.transpose();
      }
    }
  }

  const std::vector<char>& of_lens_;
  const BundleProblem& problem_;
  std::vector<std::vector<std::size_t>> by_point_;  // measurements of each point
  std::vector<int> free_;                           // index of each free camera, or -1
  int free_count_ = 0;
  std::vector<double> norms_;
  Eigen::MatrixXd matrix_;  // lower triangle
  Eigen::VectorXd gradient_;
  std::vector<Seen> seen_;  // scratch memory
};

}  // namespace

std::optional<std::string> ReadoutEstimationOptions::Validate() const {
  return OptionCheck()
      .Positive(prior_sigma_s, "sigma of an unknown readout time")
      .AtLeast(common_sigma_s, 0, "common error of a readout time")
      .AtLeast(min_sigmas, 0, "significance of a readout time")
      .AtLeast(min_readout_s, 0, "smallest readout time")
      .AtLeast(min_change_s, 0, "change of a readout time")
      .Positive(max_readout_s, "largest readout time")
      .AtLeast(min_rate, 0, "rotation rate")
      .AtLeast(min_measurements, 1, "number of measurements used to estimate the readout time")
      .fault();
}

std::optional<ReadoutEstimate> EstimateReadout(const ReadoutEstimationOptions& options,
                                               const std::vector<char>& of_lens,
                                               const BundleProblem& problem) {
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  int measurements = 0;
  for (const BundleProblem::Measurement& measurement : problem.measurements) {
    const auto c = static_cast<std::size_t>(measurement.camera);
    const ReadoutMotion& motion = problem.cameras[c].model->readout_motion();
    if (!of_lens[c] || motion.rotation_rate.norm() < options.min_rate) continue;
    before = motion.readout_s;
    ++measurements;
  }
  if (measurements < options.min_measurements) return std::nullopt;
  ReadoutProblem reduced(of_lens, problem);
  const double sigma = reduced.Sigma();
  Eigen::Matrix2d information;
  Eigen::Vector2d gradient;
  if (!reduced.Reduce(sigma, &information, &gradient)) return std::nullopt;
  const auto& known = options.prior;
  const double prior_sigma_s = known ? known->sigma_s : options.prior_sigma_s,
               prior = 1 / (prior_sigma_s * prior_sigma_s);
  const double variance = (known ? kReadoutRateErrors * kReadoutRateErrors : 1) * sigma * sigma;
  const double common_variance = known ? options.common_sigma_s * options.common_sigma_s : 0;
  const Eigen::Vector2d measured = (information * before - gradient) / variance;
  ReadoutEstimate estimate;
  // Rows are exposed one after another, or columns: each axis is estimated as if the other one were zero.
  for (int axis = 0; axis < 2; ++axis) {
    const double independent = information(axis, axis) / variance;
    const double weight = 1 / (1 + independent * common_variance);
    const double total = weight * independent + prior;
    const double weighted = weight * measured[axis] + (known ? prior * known->readout_s[axis] : 0);
    estimate.readout_s[axis] = std::clamp(weighted / total, -options.max_readout_s, options.max_readout_s);
    estimate.sigma_s[axis] = 1 / std::sqrt(total);
  }
  return estimate;
}

}  // namespace docent::engine
