// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/lens_bundle.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <numeric>

namespace docent::engine {

namespace {

constexpr int kLensParameters = LensParameters::kCount;
constexpr double kMinLensCurvature = 1e-6;

}  // namespace

CameraModel LensParameters::Model(int width_px, int height_px) const {
  return {LensModel::kRadialTangential,
          {width_px, height_px, focal(), focal(), cx(), cy()},
          {k1(), k2(), 0, 0, 0}};
}

LensBundle::LensBundle(const SelfCalibrationOptions& options, const std::vector<char>& unknown,
                       const BundleProblem& problem)
    : options_(options), problem_(problem), unknown_(unknown) {
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    begin_state_.poses.push_back(problem.cameras[i].camera_from_map);
    if (unknown[i] && first_unknown_ < 0) first_unknown_ = static_cast<int>(i);
  }
  for (const BundleProblem::Point& point : problem.points) begin_state_.points.push_back(point.position);
  Pack();
  if (first_unknown_ < 0) return;
  const auto& lens = problem.cameras[static_cast<std::size_t>(first_unknown_)].model;
  const auto& in = lens->intrinsics();
  width_px_ = in.width_px;
  height_px_ = in.height_px;
  begin_state_.lens.values << std::log(in.fx), lens->distortion()[0], lens->distortion()[1], in.cx, in.cy;
  const double side = std::max(width_px_, height_px_);
  prior_ << 0, options.k1_prior_sigma, options.k2_prior_sigma, options.center_prior_sigma * side,
      options.center_prior_sigma * side;
  expected_ << 0, 0, 0, 0.5 * (width_px_ - 1), 0.5 * (height_px_ - 1);
}

void LensBundle::Pack() {
  std::vector<std::size_t> next(problem_.points.size() + 1, 0);
  for (const BundleProblem::Measurement& measurement : problem_.measurements)
    ++next[static_cast<std::size_t>(measurement.point) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  first_of_point_ = next;
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

// by_camera: null if no derivatives are wanted.
bool LensBundle::ProjectUnknown(const LensParameters& lens, const Eigen::Vector3d& x, Eigen::Vector2d* pixel,
                                Eigen::Matrix<double, 2, 3>* by_camera, Linearized* out) const {
  if (!(x.z() > 0)) return false;
  const double focal = lens.focal(), k1 = lens.k1(), k2 = lens.k2();
  const double u = x.x() / x.z(), v = x.y() / x.z(), s = u * u + v * v;
  const double radial = 1 + s * (k1 + s * k2);
  // Outside this range the distortion is not monotonic.
  if (!(1 + s * (3 * k1 + s * 5 * k2) > 0) || !(radial > 0) || !std::isfinite(s)) return false;
  *pixel = {lens.cx() + focal * radial * u, lens.cy() + focal * radial * v};
  if (by_camera == nullptr) return true;
  const double iz = 1 / x.z(), slope = 2 * (k1 + 2 * k2 * s);
  const double uu = focal * (radial + slope * u * u) * iz, uv = focal * slope * u * v * iz;
  const double vv = focal * (radial + slope * v * v) * iz;
  *by_camera << uu, uv, -(uu * u + uv * v), uv, vv, -(uv * u + vv * v);
  out->by_lens << focal * radial * u, focal * s * u, focal * s * s * u, 1, 0,  //
      focal * radial * v, focal * s * v, focal * s * s * v, 0, 1;
  for (int i = 1; i < kLensParameters; ++i) {
    if (prior_[i] <= 0) out->by_lens.col(i).setZero();
  }
  return true;
}

bool LensBundle::Residual(const LensBundleState& state, const BundleProblem::Measurement& measurement,
                          Linearized* out, bool jacobians) const {
  const auto c = static_cast<std::size_t>(measurement.camera);
  const Rigid3& pose = state.poses[c];
  const Eigen::Vector3d x = pose * state.points[static_cast<std::size_t>(measurement.point)];
  Eigen::Matrix<double, 2, 3> by_camera;
  Eigen::Vector2d pixel;
  if (unknown_[c]) {
    const Eigen::Vector3d exposed =
        problem_.cameras[c].model->AtExposureOf(measurement.pixel.cast<double>(), x);
    if (!ProjectUnknown(state.lens, exposed, &pixel, jacobians ? &by_camera : nullptr, out)) return false;
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

double LensBundle::LinearizeWeighted(const LensBundleState& state, double norm, RobustLoss loss,
                                     double threshold, const BundleProblem::Measurement& measurement,
                                     Linearized* out) const {
  if (!std::isfinite(norm)) return 0;
  const double weight = EvaluateLoss(loss, threshold, norm).slope;
  return weight > 0 && Residual(state, measurement, out, true) ? weight : 0;
}

std::vector<double> LensBundle::Norms(const LensBundleState& state) const {
  std::vector<double> norms(order_.size());
  Linearized linearized;
  for (std::size_t i = 0; i < order_.size(); ++i) {
    norms[i] = Residual(state, At(i), &linearized, false) ? linearized.residual.squaredNorm()
                                                          : std::numeric_limits<double>::infinity();
  }
  return norms;
}

double LensBundle::PriorCost(const LensParameters& lens) const {
  double cost = 0;
  for (int i = 1; i < kLensParameters; ++i) {
    if (prior_[i] > 0) cost += 0.5 * std::pow((lens.values[i] - expected_[i]) / prior_[i], 2);
  }
  return cost;
}

void LensBundle::Linearize(const LensBundleState& state, const std::vector<double>& norms, RobustLoss loss,
                           double threshold, double damping, Reduced* out) {
  const Eigen::Index size = lens_at() + kLensParameters;
  out->matrix.setZero(size, size);
  out->gradient.setZero(size);
  out->inverse.resize(state.points.size());
  out->point_gradient.resize(state.points.size());
  Linearized linearized;
  for (std::size_t p = 0; p < state.points.size(); ++p) {
    PointEquations equations;
    seen_.clear();
    for (std::size_t i = FirstOf(p); i < FirstOf(p + 1); ++i) {
      const double weight = LinearizeWeighted(state, norms[i], loss, threshold, At(i), &linearized);
      if (weight > 0) Add(linearized, weight, static_cast<std::size_t>(At(i).camera), &equations, out);
    }
    Eliminate(p, damping, &equations, out);
  }
  AddPriors(state.lens, out);
  if (!options_.refine_lens) {
    out->matrix.bottomRows<kLensParameters>().setZero();
    out->matrix.bottomRightCorner<kLensParameters, kLensParameters>().setIdentity();
    out->gradient.tail<kLensParameters>().setZero();
  }
  out->matrix.diagonal() += damping * out->matrix.diagonal().cwiseMax(kMinLensCurvature);
}

void LensBundle::Add(const Linearized& m, double weight, std::size_t camera, PointEquations* point,
                     Reduced* out) {
  point->hessian.noalias() += weight * m.by_point.transpose() * m.by_point;
  point->gradient.noalias() += weight * m.by_point.transpose() * m.residual;
  point->lens_coupling.noalias() += weight * m.by_lens.transpose() * m.by_point;
  out->matrix.bottomRightCorner<kLensParameters, kLensParameters>().noalias() +=
      weight * m.by_lens.transpose() * m.by_lens;
  out->gradient.tail<kLensParameters>().noalias() += weight * m.by_lens.transpose() * m.residual;
  const int at = free_index_[camera];
  if (at < 0) return;
  const Eigen::Index row = 6 * at;
  out->matrix.block<6, 6>(row, row).noalias() += weight * m.by_pose.transpose() * m.by_pose;
  out->matrix.block<kLensParameters, 6>(lens_at(), row).noalias() +=
      weight * m.by_lens.transpose() * m.by_pose;
  out->gradient.segment<6>(row).noalias() += weight * m.by_pose.transpose() * m.residual;
  seen_.push_back({at, weight * m.by_pose.transpose() * m.by_point});
}

void LensBundle::Eliminate(std::size_t point, double damping, PointEquations* equations, Reduced* out) {
  Eigen::Matrix3d& hessian = equations->hessian;
  hessian.diagonal() += damping * hessian.diagonal().cwiseMax(kMinLensCurvature);
  // Keeps the matrix invertible for a point without inliers, which is then not moved.
  hessian.diagonal().array() += 1e-12;
  const Eigen::Matrix3d inverse = hessian.inverse();
  out->inverse[point] = inverse;
  out->point_gradient[point] = equations->gradient;
  const Eigen::Vector3d step = inverse * equations->gradient;
  const LensCoupling lens_solved = equations->lens_coupling * inverse;
  out->matrix.bottomRightCorner<kLensParameters, kLensParameters>().noalias() -=
      lens_solved * equations->lens_coupling.transpose();
  out->gradient.tail<kLensParameters>().noalias() -= equations->lens_coupling * step;
  for (const Seen& a : seen_) {
    const Eigen::Index row = 6 * a.at;
    const Eigen::Matrix<double, 6, 3> solved = a.coupling * inverse;
    out->gradient.segment<6>(row).noalias() -= a.coupling * step;
    out->matrix.block<kLensParameters, 6>(lens_at(), row).noalias() -= lens_solved * a.coupling.transpose();
    for (const Seen& b : seen_) {
      if (b.at > a.at) continue;
      out->matrix.block<6, 6>(row, 6 * b.at).noalias() -= solved * b.coupling.transpose();
    }
  }
}

void LensBundle::AddPriors(const LensParameters& lens, Reduced* out) const {
  for (int i = 1; i < kLensParameters; ++i) {
    const Eigen::Index at = lens_at() + i;
    // A parameter that is not estimated has no other curvature.
    const double prior = prior_[i] > 0 ? 1 / (prior_[i] * prior_[i]) : 1;
    out->matrix(at, at) += prior;
    if (prior_[i] > 0) out->gradient(at) += prior * (lens.values[i] - expected_[i]);
  }
}

LensBundleState LensBundle::Step(const LensBundleState& state, const std::vector<double>& norms,
                                 RobustLoss loss, double threshold, const Reduced& reduced,
                                 const Eigen::VectorXd& step) const {
  LensBundleState next = state;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    const Eigen::Matrix<double, 6, 1> twist = step.segment<6>(static_cast<Eigen::Index>(6 * i));
    next.poses[free_[i]] = Rigid3::Exp(twist) * state.poses[free_[i]];
  }
  const LensParameters::Vector lens_step = step.tail<kLensParameters>();
  next.lens.values += lens_step;
  Linearized m;
  for (std::size_t p = 0; p < state.points.size(); ++p) {
    Eigen::Vector3d pull = reduced.point_gradient[p];
    for (std::size_t i = FirstOf(p); i < FirstOf(p + 1); ++i) {
      const double weight = LinearizeWeighted(state, norms[i], loss, threshold, At(i), &m);
      if (!(weight > 0)) continue;
      Eigen::Vector2d moved = m.by_lens * lens_step;
      const int at = free_index_[static_cast<std::size_t>(At(i).camera)];
      if (at >= 0) moved += m.by_pose * step.segment<6>(6 * at);
      pull.noalias() += weight * m.by_point.transpose() * moved;
    }
    next.points[p] -= reduced.inverse[p] * pull;
  }
  return next;
}

}  // namespace docent::engine
