// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/self_calibration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/mapping/bundle/robust_loss.h"

namespace docent::engine {

namespace {

using Twist = Eigen::Matrix<double, 6, 1>;
using Measurement = BundleProblem::Measurement;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Both have 95 % efficiency under Gaussian noise (as in BundleOptions).
constexpr double kTukeyFactor = 4.685, kHuberFactor = 1.345;
constexpr double kMinSigma = 0.4;
// Fewer measurements leave little redundancy for a lens in addition to the poses of eight keyframes.
constexpr std::size_t kMinMeasurements = 100;
constexpr double kCostTolerance = 1e-7;
constexpr double kMinLensCurvature = 1e-6;
// Tangents of half the field of view: results outside 6 to 150 degrees are rejected.
constexpr double kMaxHalfTangent = 3.73, kMinHalfTangent = 0.052;

// The parameters of a lens, in this order: the logarithm of the focal length, k1, k2, and the principal point
// in pixels.
constexpr int kUnknowns = 5;
using LensVector = Eigen::Matrix<double, kUnknowns, 1>;
struct Lens {
  LensVector values = LensVector::Zero();
  double log_focal() const { return values[0]; }
  double focal() const { return std::exp(values[0]); }
  double k1() const { return values[1]; }
  double k2() const { return values[2]; }
  double cx() const { return values[3]; }
  double cy() const { return values[4]; }
  CameraModel Model(int width_px, int height_px) const {
    return {LensModel::kRadialTangential,
            {width_px, height_px, focal(), focal(), cx(), cy()},
            {k1(), k2(), 0, 0, 0}};
  }
};

struct State {
  std::vector<Rigid3> poses;
  std::vector<Eigen::Vector3d> points;
  Lens lens;
};

// A measurement linearized at a state, divided by its sigma.
struct Linearized {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kUnknowns> by_lens;
};

class Calibrator {
 public:
  Calibrator(const SelfCalibrationOptions& options, const std::vector<char>& unknown,
             const BundleProblem& problem)
      : options_(options), problem_(problem), unknown_(unknown) {
    for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
      state_.poses.push_back(problem.cameras[i].camera_from_map);
      if (unknown[i] && first_unknown_ < 0) first_unknown_ = static_cast<int>(i);
    }
    for (const BundleProblem::Point& point : problem.points) state_.points.push_back(point.position);
    Pack();
    if (first_unknown_ < 0) return;
    const auto& lens = problem.cameras[static_cast<std::size_t>(first_unknown_)].model;
    const auto& in = lens->intrinsics();
    width_px_ = in.width_px;
    height_px_ = in.height_px;
    state_.lens.values << std::log(in.fx), lens->distortion()[0], lens->distortion()[1], in.cx, in.cy;
    const double side = std::max(width_px_, height_px_);
    prior_ << 0, options.k1_prior_sigma, options.k2_prior_sigma, options.center_prior_sigma * side,
        options.center_prior_sigma * side;
    expected_ << 0, 0, 0, 0.5 * (width_px_ - 1), 0.5 * (height_px_ - 1);
  }

  SelfCalibration Run() {
    SelfCalibration result;
    if (first_unknown_ < 0 || order_.size() < kMinMeasurements) return result;
    const State begin = state_;
    if (!options_.fields_of_view_deg.empty() && options_.refine_lens) {
      SelectInitialFocalLength();
    } else {
      Descend(RobustLoss::kHuber, kHuberFactor, options_.max_iterations / 2);
    }
    if (!interrupted()) Descend(RobustLoss::kTukey, kTukeyFactor, options_.max_iterations);
    if (interrupted()) {
      result.outcome = SelfCalibration::Outcome::kInterrupted;
      return result;
    }
    result.iterations = iterations_;
    result.sigma = EstimateSigma(norms_);
    const double threshold = kTukeyFactor * std::max(kMinSigma, result.sigma);
    result.cost = RobustCost(RobustLoss::kTukey, threshold, norms_);
    if (!LensIsPlausible() || !ComputeSigmas(threshold, &result)) return result;
    result.focal_px = state_.lens.focal();
    result.lens = state_.lens.Model(width_px_, height_px_);
    RestoreScale(begin);
    result.outcome = SelfCalibration::Outcome::kDone;
    return result;
  }

  void WriteBack(BundleProblem* problem) const {
    const auto lens = std::make_shared<const CameraModel>(state_.lens.Model(width_px_, height_px_));
    for (std::size_t i = 0; i < problem->cameras.size(); ++i) {
      BundleProblem::Camera& camera = problem->cameras[i];
      camera.camera_from_map = state_.poses[i];
      if (unknown_[i] && options_.refine_lens) camera.model = lens;
    }
    for (std::size_t i = 0; i < problem->points.size(); ++i) problem->points[i].position = state_.points[i];
    const double sigma = EstimateSigma(norms_);
    const double threshold = kTukeyFactor * std::max(kMinSigma, sigma);
    for (std::size_t i = 0; i < order_.size(); ++i)
      problem->measurements[order_[i]].outlier = !(norms_[i] < threshold * threshold);
  }

 private:
  bool interrupted() const {
    return options_.interrupt != nullptr && options_.interrupt->load(std::memory_order_relaxed);
  }
  std::size_t lens_at() const { return 6 * free_.size(); }

  void Pack() {
    std::vector<std::size_t> next(problem_.points.size() + 1, 0);
    for (const Measurement& measurement : problem_.measurements)
      ++next[static_cast<std::size_t>(measurement.point) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    begin_ = next;
    order_.resize(problem_.measurements.size());
    for (std::size_t i = 0; i < order_.size(); ++i)
      order_[next[static_cast<std::size_t>(problem_.measurements[i].point)]++] = i;
    const bool any_fixed = std::any_of(problem_.cameras.begin(), problem_.cameras.end(),
                                       [](const BundleProblem::Camera& camera) { return camera.fixed; });
    free_index_.assign(problem_.cameras.size(), -1);
    for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
      if (problem_.cameras[i].fixed || (!any_fixed && i == 0)) {
        if (anchor_ < 0) anchor_ = static_cast<int>(i);
        continue;
      }
      free_index_[i] = static_cast<int>(free_.size());
      free_.push_back(i);
    }
  }

  const Measurement& At(std::size_t i) const { return problem_.measurements[order_[i]]; }

  // Returns false if the point cannot be projected.
  bool Residual(const State& state, const Measurement& measurement, Linearized* out, bool jacobians) const {
    const auto c = static_cast<std::size_t>(measurement.camera);
    const Rigid3& pose = state.poses[c];
    const Eigen::Vector3d x = pose * state.points[static_cast<std::size_t>(measurement.point)];
    Eigen::Matrix<double, 2, 3> by_camera;
    Eigen::Vector2d pixel;
    if (unknown_[c]) {
      if (!(x.z() > 0)) return false;
      const double focal = state.lens.focal(), k1 = state.lens.k1(), k2 = state.lens.k2();
      const double u = x.x() / x.z(), v = x.y() / x.z(), s = u * u + v * v;
      const double radial = 1 + s * (k1 + s * k2);
      // Outside this range the distortion is not monotonic.
      if (!(1 + s * (3 * k1 + s * 5 * k2) > 0) || !(radial > 0) || !std::isfinite(s)) return false;
      pixel = {state.lens.cx() + focal * radial * u, state.lens.cy() + focal * radial * v};
      if (jacobians) {
        const double iz = 1 / x.z(), slope = 2 * (k1 + 2 * k2 * s);
        const double uu = focal * (radial + slope * u * u) * iz, uv = focal * slope * u * v * iz;
        const double vv = focal * (radial + slope * v * v) * iz;
        by_camera << uu, uv, -(uu * u + uv * v), uv, vv, -(uv * u + vv * v);
        out->by_lens << focal * radial * u, focal * s * u, focal * s * s * u, 1, 0,  //
            focal * radial * v, focal * s * v, focal * s * s * v, 0, 1;
        for (int i = 1; i < kUnknowns; ++i) {
          if (prior_[i] <= 0) out->by_lens.col(i).setZero();
        }
      }
    } else {
      if (!problem_.cameras[c].model->Project(x, &pixel, jacobians ? &by_camera : nullptr)) return false;
      out->by_lens.setZero();
    }
    const double scale = 1 / static_cast<double>(measurement.sigma_px);
    out->residual = scale * (pixel - measurement.pixel.cast<double>());
    if (!out->residual.allFinite()) return false;
    if (!jacobians) return true;
    by_camera *= scale;
    out->by_lens *= scale;
    out->by_pose.leftCols<3>() = by_camera;
    out->by_pose.rightCols<3>() = -by_camera * Hat(x);
    out->by_point = by_camera * pose.rotation.matrix();
    return true;
  }

  std::vector<double> Norms(const State& state) const {
    std::vector<double> norms(order_.size());
    Linearized linearized;
    for (std::size_t i = 0; i < order_.size(); ++i) {
      norms[i] = Residual(state, At(i), &linearized, false) ? linearized.residual.squaredNorm() : kInfinity;
    }
    return norms;
  }

  double PriorCost(const Lens& lens) const {
    double cost = 0;
    for (int i = 1; i < kUnknowns; ++i) {
      if (prior_[i] > 0) cost += 0.5 * std::pow((lens.values[i] - expected_[i]) / prior_[i], 2);
    }
    return cost;
  }

  // The normal equations after elimination of the points (Schur complement).
  struct Reduced {
    Eigen::MatrixXd matrix;    // lower triangle
    Eigen::VectorXd gradient;  // after elimination
    std::vector<Eigen::Matrix3d> inverse;
    std::vector<Eigen::Vector3d> point_gradient;
  };
  using LensCoupling = Eigen::Matrix<double, kUnknowns, 3>;
  struct Seen {
    int at = -1;  // index of the camera in free_
    Eigen::Matrix<double, 6, 3> coupling;
  };

  void Linearize(RobustLoss loss, double threshold, double damping, Reduced* out) {
    const auto size = static_cast<Eigen::Index>(lens_at() + kUnknowns),
               lens = static_cast<Eigen::Index>(lens_at());
    out->matrix.setZero(size, size);
    out->gradient.setZero(size);
    out->inverse.resize(state_.points.size());
    out->point_gradient.resize(state_.points.size());
    Linearized m;
    for (std::size_t p = 0; p < state_.points.size(); ++p) {
      Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      LensCoupling lens_coupling = LensCoupling::Zero();
      seen_.clear();
      for (std::size_t i = begin_[p]; i < begin_[p + 1]; ++i) {
        if (!std::isfinite(norms_[i])) continue;
        const double weight = EvaluateLoss(loss, threshold, norms_[i]).slope;
        if (!(weight > 0) || !Residual(state_, At(i), &m, true)) continue;
        hessian.noalias() += weight * m.by_point.transpose() * m.by_point;
        gradient.noalias() += weight * m.by_point.transpose() * m.residual;
        lens_coupling.noalias() += weight * m.by_lens.transpose() * m.by_point;
        out->matrix.bottomRightCorner<kUnknowns, kUnknowns>().noalias() +=
            weight * m.by_lens.transpose() * m.by_lens;
        out->gradient.tail<kUnknowns>().noalias() += weight * m.by_lens.transpose() * m.residual;
        const int at = free_index_[static_cast<std::size_t>(At(i).camera)];
        if (at < 0) continue;
        const Eigen::Index row = 6 * at;
        out->matrix.block<6, 6>(row, row).noalias() += weight * m.by_pose.transpose() * m.by_pose;
        out->matrix.block<kUnknowns, 6>(lens, row).noalias() += weight * m.by_lens.transpose() * m.by_pose;
        out->gradient.segment<6>(row).noalias() += weight * m.by_pose.transpose() * m.residual;
        seen_.push_back({at, weight * m.by_pose.transpose() * m.by_point});
      }
      hessian.diagonal() += damping * hessian.diagonal().cwiseMax(kMinLensCurvature);
      // Keeps the matrix invertible for a point without inliers, which is then not moved.
      hessian.diagonal().array() += 1e-12;
      const Eigen::Matrix3d inverse = hessian.inverse();
      out->inverse[p] = inverse;
      out->point_gradient[p] = gradient;
      const Eigen::Vector3d step = inverse * gradient;
      const LensCoupling lens_solved = lens_coupling * inverse;
      out->matrix.bottomRightCorner<kUnknowns, kUnknowns>().noalias() -=
          lens_solved * lens_coupling.transpose();
      out->gradient.tail<kUnknowns>().noalias() -= lens_coupling * step;
      for (std::size_t a = 0; a < seen_.size(); ++a) {
        const Eigen::Index row = 6 * seen_[a].at;
        const Eigen::Matrix<double, 6, 3> solved = seen_[a].coupling * inverse;
        out->gradient.segment<6>(row).noalias() -= seen_[a].coupling * step;
        out->matrix.block<kUnknowns, 6>(lens, row).noalias() -= lens_solved * seen_[a].coupling.transpose();
        for (std::size_t b = 0; b < seen_.size(); ++b) {
          if (seen_[b].at > seen_[a].at) continue;
          out->matrix.block<6, 6>(row, 6 * seen_[b].at).noalias() -= solved * seen_[b].coupling.transpose();
        }
      }
    }
    for (int i = 1; i < kUnknowns; ++i) {
      const Eigen::Index at = lens + i;
      // A parameter that is not estimated has no other curvature.
      const double prior = prior_[i] > 0 ? 1 / (prior_[i] * prior_[i]) : 1;
      out->matrix(at, at) += prior;
      if (prior_[i] > 0) out->gradient(at) += prior * (state_.lens.values[i] - expected_[i]);
    }
    if (!options_.refine_lens) {
      out->matrix.bottomRows<kUnknowns>().setZero();
      out->matrix.bottomRightCorner<kUnknowns, kUnknowns>().setIdentity();
      out->gradient.tail<kUnknowns>().setZero();
    }
    out->matrix.diagonal() += damping * out->matrix.diagonal().cwiseMax(kMinLensCurvature);
  }

  // The state after a step of cameras and lens, with the points by back substitution.
  State Step(RobustLoss loss, double threshold, const Reduced& reduced, const Eigen::VectorXd& step) const {
    State next = state_;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const Twist twist = step.segment<6>(static_cast<Eigen::Index>(6 * i));
      next.poses[free_[i]] = Rigid3::Exp(twist) * state_.poses[free_[i]];
    }
    const LensVector lens_step = step.tail<kUnknowns>();
    next.lens.values += lens_step;
    Linearized m;
    for (std::size_t p = 0; p < state_.points.size(); ++p) {
      Eigen::Vector3d pull = reduced.point_gradient[p];
      for (std::size_t i = begin_[p]; i < begin_[p + 1]; ++i) {
        if (!std::isfinite(norms_[i])) continue;
        const double weight = EvaluateLoss(loss, threshold, norms_[i]).slope;
        if (!(weight > 0) || !Residual(state_, At(i), &m, true)) continue;
        Eigen::Vector2d moved = m.by_lens * lens_step;
        const int at = free_index_[static_cast<std::size_t>(At(i).camera)];
        if (at >= 0) moved += m.by_pose * step.segment<6>(6 * at);
        pull.noalias() += weight * m.by_point.transpose() * moved;
      }
      next.points[p] -= reduced.inverse[p] * pull;
    }
    return next;
  }

  void Descend(RobustLoss loss, double factor, int most) {
    norms_ = Norms(state_);
    const auto wanted = [&] { return factor * std::max(kMinSigma, EstimateSigma(norms_)); };
    double threshold = wanted(), damping = 1e-4, grow = 2;
    const auto cost_of = [&](const State& state, const std::vector<double>& norms) {
      return RobustCost(loss, threshold, norms) + PriorCost(state.lens);
    };
    double cost = cost_of(state_, norms_);
    Reduced reduced;
    for (int iteration = 0; iteration < most && !interrupted(); ++iteration) {
      ++iterations_;
      Linearize(loss, threshold, damping, &reduced);
      const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factored(reduced.matrix);
      bool arrived = false, better = false;
      if (factored.info() == Eigen::Success) {
        const Eigen::VectorXd step = -factored.solve(reduced.gradient);
        // The linearization does not hold for a larger relative change of the focal length.
        constexpr double kMaxFocalStep = 0.25;
        if (step.allFinite() && std::abs(step[step.size() - kUnknowns]) < kMaxFocalStep) {
          State next = Step(loss, threshold, reduced, step);
          std::vector<double> norms = Norms(next);
          const double next_cost = cost_of(next, norms);
          better = next_cost < cost;
          arrived = std::abs(cost - next_cost) <= kCostTolerance * cost && damping < 1;
          if (better) {
            state_ = std::move(next);
            norms_ = std::move(norms);
            cost = next_cost;
          }
        }
      }
      if (better) {
        damping = std::max(1e-9, damping / 5);
        grow = 2;
      } else {
        damping *= grow;
        grow *= 2;
        if (damping > 1e12) break;
      }
      // The threshold is lowered with the residuals, as in AdjustBundle.
      const double now = wanted();
      if (now < 0.8 * threshold || (arrived && std::abs(now - threshold) > 0.1 * threshold)) {
        threshold = now;
        cost = cost_of(state_, norms_);
        arrived = false;
      }
      if (arrived) break;
    }
  }

  // An initial state for another focal length. The scene is stretched along the optical axis: images of a
  // camera that does not rotate stay the same (the ambiguity of a translating camera), and rotations are
  // divided by the ratio of the focal lengths.
  State WithFocalLength(const State& from, double focal) const {
    State to = from;
    const double focal_ratio = focal / from.lens.focal();
    to.lens.values = expected_;
    to.lens.values[0] = std::log(focal);
    const Rigid3& anchor = from.poses[static_cast<std::size_t>(std::max(anchor_, 0))];
    const Eigen::Vector3d stretch(1, 1, focal_ratio);
    for (std::size_t i = 0; i < to.poses.size(); ++i) {
      const Rigid3 camera_from_anchor = from.poses[i] * anchor.inverse();
      Eigen::Vector3d rotation_vector = camera_from_anchor.rotation.Log();
      if (unknown_[i]) rotation_vector.head<2>() /= focal_ratio;
      const Rotation3 rotation = Rotation3::Exp(rotation_vector);
      const Eigen::Vector3d center = stretch.cwiseProduct(camera_from_anchor.OriginInSource());
      to.poses[i] = Rigid3(rotation, -(rotation * center)) * anchor;
    }
    const Rigid3 map_from_anchor = anchor.inverse();
    for (Eigen::Vector3d& point : to.points)
      point = map_from_anchor * Eigen::Vector3d(stretch.cwiseProduct(anchor * point));
    return to;
  }

  void SelectInitialFocalLength() {
    const State begin = state_;
    struct Trial {
      State state;
      std::vector<double> norms;
    };
    std::vector<Trial> trials;
    std::vector<double> focals = {begin.lens.focal()};
    for (const double degrees : options_.fields_of_view_deg) {
      const double focal = LensWithFieldOfView(width_px_, height_px_, degrees).intrinsics().fx;
      // This start would lead to the same minimum as the current lens.
      if (std::abs(std::log(focal / begin.lens.focal())) > 0.1) focals.push_back(focal);
    }
    for (std::size_t i = 0; i < focals.size() && !interrupted(); ++i) {
      state_ = i == 0 ? begin : WithFocalLength(begin, focals[i]);
      Descend(RobustLoss::kHuber, kHuberFactor, options_.trial_iterations);
      trials.push_back({state_, norms_});
    }
    // The costs are comparable only with the same threshold.
    double sigma = kInfinity;
    for (const Trial& trial : trials) sigma = std::min(sigma, EstimateSigma(trial.norms));
    const double threshold = kTukeyFactor * std::max(kMinSigma, sigma);
    double best_cost = kInfinity;
    for (const Trial& trial : trials) {
      const double cost = RobustCost(RobustLoss::kTukey, threshold, trial.norms);
      if (!(cost < best_cost)) continue;
      best_cost = cost;
      state_ = trial.state;
      norms_ = trial.norms;
    }
  }

  bool LensIsPlausible() const {
    const double tangent = 0.5 * std::max(width_px_, height_px_) / state_.lens.focal();
    if (!(tangent > kMinHalfTangent && tangent < kMaxHalfTangent) || !state_.lens.values.allFinite())
      return false;
    const CameraModel lens = state_.lens.Model(width_px_, height_px_);
    return !CameraModel::Validate(lens.lens(), lens.intrinsics(), lens.distortion()).has_value();
  }

  // With a single fixed camera the scale is undetermined and the normal equations are singular. Adds
  // curvature along the scale, which does not affect the lens.
  void FixScale(Eigen::MatrixXd* matrix) const {
    if (free_.size() + 1 != state_.poses.size()) return;
    const Eigen::Vector3d center = state_.poses[static_cast<std::size_t>(anchor_)].OriginInSource();
    Eigen::VectorXd scale_direction = Eigen::VectorXd::Zero(matrix->rows());
    for (std::size_t i = 0; i < free_.size(); ++i)
      scale_direction.segment<3>(static_cast<Eigen::Index>(6 * i)) = state_.poses[free_[i]] * center;
    if (!(scale_direction.norm() > 0)) return;
    *matrix +=
        matrix->diagonal().mean() * scale_direction.normalized() * scale_direction.normalized().transpose();
  }

  // Computes the standard deviations from the influence of each measurement on the lens in the linearized
  // equations. Sums over points and over keyframes account for correlated errors (see SelfCalibration).
  bool ComputeSigmas(double threshold, SelfCalibration* result) {
    if (!options_.refine_lens) return true;
    Reduced reduced;
    Linearize(RobustLoss::kTukey, threshold, 1e-10, &reduced);
    FixScale(&reduced.matrix);
    const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factored(reduced.matrix);
    if (factored.info() != Eigen::Success) return false;
    const Eigen::Index size = reduced.matrix.rows();
    // Rows of the inverse for the focal length and k1.
    Eigen::MatrixXd pick = Eigen::MatrixXd::Zero(size, 2);
    pick.bottomRows<kUnknowns>().topRows<2>().setIdentity();
    const Eigen::MatrixXd rows = factored.solve(pick);
    const Eigen::Matrix2d formal = rows.bottomRows<kUnknowns>().topRows<2>();
    std::vector<Eigen::Vector2d> of_keyframe(state_.poses.size(), Eigen::Vector2d::Zero());
    Eigen::Vector2d by_points = Eigen::Vector2d::Zero(), by_measurements = Eigen::Vector2d::Zero();
    double weights = 0, slopes = 0;
    struct Part {
      Eigen::Vector2d residual;  // weighted
      Eigen::Matrix2d by_rows;   // the derivative, along the two rows of the inverse
      Eigen::Matrix<double, 2, 3> by_point;
      std::size_t camera;
    };
    std::vector<Part> parts;
    Linearized m;
    for (std::size_t p = 0; p < state_.points.size(); ++p) {
      parts.clear();
      Eigen::Matrix<double, 3, 2> pull = Eigen::Matrix<double, 3, 2>::Zero();
      for (std::size_t i = begin_[p]; i < begin_[p + 1]; ++i) {
        if (!std::isfinite(norms_[i])) continue;
        const double weight = EvaluateLoss(RobustLoss::kTukey, threshold, norms_[i]).slope;
        if (!(weight > 0) || !Residual(state_, At(i), &m, true)) continue;
        Part part;
        part.camera = static_cast<std::size_t>(At(i).camera);
        part.residual = weight * m.residual;
        part.by_rows = m.by_lens * rows.bottomRows<kUnknowns>();
        if (const int at = free_index_[part.camera]; at >= 0)
          part.by_rows.noalias() += m.by_pose * rows.middleRows<6>(6 * at);
        part.by_point = m.by_point;
        pull.noalias() += weight * m.by_point.transpose() * part.by_rows;
        parts.push_back(part);
        // The derivative of Tukey's influence function is smaller than its weight.
        weights += weight;
        slopes += weight - 4 * std::sqrt(weight) * 0.5 * norms_[i] / (threshold * threshold);
      }
      const Eigen::Matrix<double, 3, 2> solved = reduced.inverse[p] * pull;
      Eigen::Vector2d of_point = Eigen::Vector2d::Zero();
      for (const Part& part : parts) {
        const Eigen::Vector2d influence = (part.by_rows - part.by_point * solved).transpose() * part.residual;
        of_point += influence;
        of_keyframe[part.camera] += influence;
        by_measurements += influence.cwiseAbs2();
      }
      by_points += of_point.cwiseAbs2();
    }
    Eigen::Vector2d by_keyframes = Eigen::Vector2d::Zero();
    double keyframes = 0;
    for (const Eigen::Vector2d& sum : of_keyframe) {
      by_keyframes += sum.cwiseAbs2();
      keyframes += sum != Eigen::Vector2d::Zero() ? 1 : 0;
    }
    // At the minimum the sums add up to zero; with few keyframes this reduces their variance.
    by_keyframes *= keyframes / std::max(1.0, keyframes - 3);
    const double weight_over_slope = slopes > 0 ? std::max(1.0, weights / slopes) : 1;
    const double variance = result->sigma * result->sigma;
    result->formal_focal_sigma = std::sqrt(std::max(0.0, variance * formal(0, 0)));
    const Eigen::Vector2d clustered =
        weight_over_slope * weight_over_slope * (by_points + by_keyframes - by_measurements);
    const auto sigma_of = [&](int i) {
      return std::sqrt(std::max(
          {variance * formal(i, i), clustered[i], weight_over_slope * weight_over_slope * by_points[i]}));
    };
    result->focal_sigma = sigma_of(0);
    result->k1_sigma = sigma_of(1);
    return std::isfinite(result->focal_sigma) && std::isfinite(result->k1_sigma);
  }

  // Scales the result so that the points seen by the anchor keep their median distance from its optical axis.
  void RestoreScale(const State& begin) {
    const auto anchor = static_cast<std::size_t>(std::max(anchor_, 0));
    std::vector<double> ratios;
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (static_cast<std::size_t>(At(i).camera) != anchor) continue;
      const auto p = static_cast<std::size_t>(At(i).point);
      const double before = (begin.poses[anchor] * begin.points[p]).head<2>().norm();
      const double after = (state_.poses[anchor] * state_.points[p]).head<2>().norm();
      if (before > 0 && after > 0 && std::isfinite(after)) ratios.push_back(before / after);
    }
    if (ratios.empty()) return;
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    // Scaling about the anchor's centre does not move it.
    const Eigen::Vector3d center = state_.poses[anchor].OriginInSource();
    for (Rigid3& pose : state_.poses) {
      const Eigen::Vector3d moved = center + *middle * (pose.OriginInSource() - center);
      pose.translation = -(pose.rotation * moved);
    }
    for (Eigen::Vector3d& point : state_.points) point = center + *middle * (point - center);
  }

  const SelfCalibrationOptions& options_;
  const BundleProblem& problem_;
  const std::vector<char>& unknown_;
  int first_unknown_ = -1, anchor_ = -1;
  int width_px_ = 0, height_px_ = 0;
  LensVector prior_ = LensVector::Zero(),
             expected_ = LensVector::Zero();  // A prior sigma of 0: not estimated.
  State state_;
  std::vector<std::size_t> order_, begin_;  // measurements by point
  std::vector<int> free_index_;             // of each camera: its index in free_, or -1
  std::vector<std::size_t> free_;
  std::vector<double> norms_;  // squared residuals of state_, in the order of order_
  std::vector<Seen> seen_;     // scratch
  int iterations_ = 0;
};

}  // namespace

std::optional<std::string> SelfCalibrationOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(fields_of_view_deg,
                                [](double degrees) { return degrees > 0 && degrees < 180; }),
            "Each field of view must be between 0 and 180 degrees.")
      .AtLeast(trial_iterations, 1, "number of iterations of a trial")
      .AtLeast(max_iterations, 1, "number of iterations of a self-calibration")
      .Positive(k1_prior_sigma, "prior sigma of k1")
      .AtLeast(k2_prior_sigma, 0, "prior sigma of k2")
      .AtLeast(center_prior_sigma, 0, "prior sigma of the principal point")
      .fault();
}

CameraModel LensWithFocalLength(int width_px, int height_px, double focal_px, double k1) {
  return {LensModel::kRadialTangential,
          {width_px, height_px, focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)},
          {k1, 0, 0, 0, 0}};
}

CameraModel LensWithFieldOfView(int width_px, int height_px, double degrees) {
  const double half = 0.5 * degrees * std::numbers::pi / 180;
  const double focal = 0.5 * std::max(width_px, height_px) / std::tan(half);
  return LensWithFocalLength(width_px, height_px, focal, 0);
}

SelfCalibration CalibrateBundle(const SelfCalibrationOptions& options, const std::vector<char>& unknown,
                                BundleProblem* problem) {
  Calibrator calibrator(Checked(options), unknown, *problem);
  const SelfCalibration result = calibrator.Run();
  if (result.outcome == SelfCalibration::Outcome::kDone) calibrator.WriteBack(problem);
  return result;
}

}  // namespace docent::engine
