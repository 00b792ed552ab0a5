// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/lens_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace docent::engine {

namespace {

// With a single fixed camera the scale is undetermined and the normal equations are singular. Adds curvature
// along the scale, which does not affect the lens.
void FixScale(const LensBundle& bundle, const LensBundleState& state, Eigen::MatrixXd* matrix) {
  const std::vector<std::size_t>& free = bundle.free_cameras();
  if (free.size() + 1 != state.poses.size()) return;
  const Eigen::Vector3d center = state.poses[bundle.anchor()].OriginInSource();
  Eigen::VectorXd scale_direction = Eigen::VectorXd::Zero(matrix->rows());
  for (std::size_t i = 0; i < free.size(); ++i)
    scale_direction.segment<3>(static_cast<Eigen::Index>(6 * i)) = state.poses[free[i]] * center;
  if (!(scale_direction.norm() > 0)) return;
  *matrix +=
      matrix->diagonal().mean() * scale_direction.normalized() * scale_direction.normalized().transpose();
}

// The squared influences of all measurements on the focal length and k1, summed in three ways.
class InfluenceSums {
 public:
  // rows: of the inverse of the reduced matrix, for the focal length and k1.
  InfluenceSums(const LensBundle& bundle, const LensBundleState& state, const Eigen::MatrixXd& rows,
                double threshold)
      : bundle_(bundle),
        state_(state),
        rows_(rows),
        threshold_(threshold),
        of_keyframe_(state.poses.size(), Eigen::Vector2d::Zero()) {}

  // inverse: of the point's Hessian.
  void AddPoint(std::size_t point, const std::vector<double>& norms, const Eigen::Matrix3d& inverse) {
    parts_.clear();
    Eigen::Matrix<double, 3, 2> pull = Eigen::Matrix<double, 3, 2>::Zero();
    LensBundle::Linearized m;
    for (std::size_t i = bundle_.FirstOf(point); i < bundle_.FirstOf(point + 1); ++i) {
      const auto& measurement = bundle_.At(i);
      const double weight =
          bundle_.LinearizeWeighted(state_, norms[i], RobustLoss::kTukey, threshold_, measurement, &m);
      if (!(weight > 0)) continue;
      Part part;
      part.camera = static_cast<std::size_t>(measurement.camera);
      part.residual = weight * m.residual;
      part.by_rows = m.by_lens * rows_.bottomRows<LensParameters::kCount>();
      if (const int at = bundle_.FreeIndex(part.camera); at >= 0)
        part.by_rows.noalias() += m.by_pose * rows_.middleRows<6>(6 * at);
      part.by_point = m.by_point;
      pull.noalias() += weight * m.by_point.transpose() * part.by_rows;
      parts_.push_back(part);
      // The derivative of Tukey's influence function is smaller than its weight.
      weights_ += weight;
      slopes_ += weight - 4 * std::sqrt(weight) * 0.5 * norms[i] / (threshold_ * threshold_);
    }
    const Eigen::Matrix<double, 3, 2> solved = inverse * pull;
    Eigen::Vector2d of_point = Eigen::Vector2d::Zero();
    for (const Part& part : parts_) {
      const Eigen::Vector2d influence = (part.by_rows - part.by_point * solved).transpose() * part.residual;
      of_point += influence;
      of_keyframe_[part.camera] += influence;
      by_measurements_ += influence.cwiseAbs2();
    }
    by_points_ += of_point.cwiseAbs2();
  }

  // Variances of the focal length and k1. formal: those if all errors were independent.
  Eigen::Vector2d Variances(const Eigen::Vector2d& formal) const {
    Eigen::Vector2d by_keyframes = Eigen::Vector2d::Zero();
    double keyframes = 0;
    for (const Eigen::Vector2d& sum : of_keyframe_) {
      by_keyframes += sum.cwiseAbs2();
      keyframes += sum != Eigen::Vector2d::Zero() ? 1 : 0;
    }
    // At the minimum the sums add up to zero; with few keyframes this reduces their variance.
    by_keyframes *= keyframes / std::max(1.0, keyframes - 3);
    const double weight_over_slope = slopes_ > 0 ? std::max(1.0, weights_ / slopes_) : 1;
    const double factor = weight_over_slope * weight_over_slope;
    const Eigen::Vector2d clustered = factor * (by_points_ + by_keyframes - by_measurements_);
    return formal.cwiseMax(clustered).cwiseMax(factor * by_points_);
  }

 private:
  struct Part {
    Eigen::Vector2d residual;  // weighted
    Eigen::Matrix2d by_rows;   // the derivative, along the two rows of the inverse
    Eigen::Matrix<double, 2, 3> by_point;
    std::size_t camera;
  };

  const LensBundle& bundle_;
  const LensBundleState& state_;
  const Eigen::MatrixXd& rows_;
  const double threshold_;
  std::vector<Eigen::Vector2d> of_keyframe_;
  Eigen::Vector2d by_points_ = Eigen::Vector2d::Zero(), by_measurements_ = Eigen::Vector2d::Zero();
  double weights_ = 0, slopes_ = 0;
  std::vector<Part> parts_;  // of the point that is being added
};

}  // namespace

std::optional<LensUncertainty> EstimateLensUncertainty(const LensBundleState& state,
                                                       const std::vector<double>& norms, double threshold,
                                                       double sigma, LensBundle* bundle) {
  constexpr int kLens = LensParameters::kCount;
  LensBundle::Reduced reduced;
  bundle->Linearize(state, norms, RobustLoss::kTukey, threshold, 1e-10, &reduced);
  FixScale(*bundle, state, &reduced.matrix);
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factored(reduced.matrix);
  if (factored.info() != Eigen::Success) return std::nullopt;
  // Rows of the inverse for the focal length and k1.
  Eigen::MatrixXd pick = Eigen::MatrixXd::Zero(reduced.matrix.rows(), 2);
  pick.bottomRows<kLens>().topRows<2>().setIdentity();
  const Eigen::MatrixXd rows = factored.solve(pick);
  const Eigen::Matrix2d inverse = rows.bottomRows<kLens>().topRows<2>();
  InfluenceSums sums(*bundle, state, rows, threshold);
  for (std::size_t p = 0; p < state.points.size(); ++p) sums.AddPoint(p, norms, reduced.inverse[p]);
  const double variance = sigma * sigma;
  const Eigen::Vector2d formal = variance * inverse.diagonal();
  const Eigen::Vector2d sigmas = sums.Variances(formal).cwiseMax(0).cwiseSqrt();
  if (!sigmas.allFinite()) return std::nullopt;
  return LensUncertainty{sigmas[0], sigmas[1], std::sqrt(std::max(0.0, formal[0]))};
}

}  // namespace docent::engine
