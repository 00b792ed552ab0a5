// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/track_bundle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/median.h"

namespace docent::engine {

namespace {

// Standard deviations of what a calibration leaves, in focal lengths where they are lengths: a focal length
// is wrong by up to a hundredth.
constexpr double kFocalSigma = 0.01, kAspectSigma = 0.003, kSkewSigma = 0.003, kCenterSigma = 0.01,
                 kRadialSigma = 0.02, kTangentialSigma = 0.002;
// Times sigma: 95 % efficiency under Gaussian noise.
constexpr double kHuberFactor = 1.345, kCauchyFactor = 2.385;
// Of the median distance. Weak: it only fixes the scale and keeps corners whose distance is not observable.
constexpr double kInverseDistanceSigma = 2, kMinInverseDistance = 0.02, kMaxInverseDistance = 50;

}  // namespace

TrackBundle::TrackBundle(const TrackBundleOptions& options, const CameraModel& camera,
                         const CornerSequence& sequence)
    : options_(&options), camera_(&camera) {
  state_.poses.resize(sequence.images.size());
  for (const CornerSequence::Image& image : sequence.images) {
    const std::size_t k = times_s_.size();
    times_s_.push_back(ToSeconds(image.time - sequence.images.front().time));
    if (k > 0) state_.poses[k].rotation = image.now_from_previous * state_.poses[k - 1].rotation;
  }
  const auto most = static_cast<std::size_t>(options.max_corners);
  const std::size_t stride = (sequence.corners.size() + most - 1) / most;
  for (std::size_t i = 0; i < sequence.corners.size(); i += stride) {
    const CornerSequence::Corner& corner = sequence.corners[i];
    const auto ray = camera.Unproject(corner.pixels.front().cast<double>());
    if (ray && ray->z() > 0)
      corners_.push_back(
          {&corner, *ray / ray->z(), LensDerivatives(ImagePoint(corner.pixels.front().cast<double>()))});
  }
  Eigen::Matrix<double, kShared, 1> sigmas;
  sigmas << kFocalSigma, kAspectSigma, kSkewSigma, kCenterSigma, kCenterSigma, kRadialSigma, kTangentialSigma,
      kTangentialSigma, options.prior_sigma_s, options.prior_sigma_s;
  prior_ = sigmas.cwiseAbs2().cwiseInverse();
  state_.inverse_distances.assign(corners_.size(), 1.0);
  for (std::size_t k = 0; k < state_.poses.size(); ++k) weights_.push_back(WeightsOf(k));
}

double TrackBundle::RobustSigma() const {
  return std::max(options_->min_noise_px, linearized_.sigma_px);
}

double TrackBundle::Cost(double sigma) const {
  double cost = 0;
  for (const double norm : linearized_.norms) cost += Loss(norm / sigma);
  cost += static_cast<double>(linearized_.residuals.size() - linearized_.norms.size()) * Loss(kHuberFactor);
  for (const double inverse : state_.inverse_distances)
    cost += (inverse - 1) * (inverse - 1) / (kInverseDistanceSigma * kInverseDistanceSigma);
  return cost + prior_.head<kLens>().dot(state_.lens.cwiseAbs2()) +
         prior_.tail<2>().dot(state_.readout_s.cwiseAbs2());
}

void TrackBundle::Adjust(std::optional<Eigen::Index> axis, int iterations) {
  constexpr double kNegligible = 1e-3, kMaxDamping = 10;
  Linearize();
  double damping = 1e-3;
  bool rejected = false;
  State state;  // before the step
  for (int i = 0; i < iterations && damping < kMaxDamping; ++i) {
    const double sigma = RobustSigma(), before = Cost(sigma);
    if (!rejected) Reduce(sigma);
    state = state_;
    Step(axis, damping);
    std::swap(linearized_, linearized_before_);
    Linearize();
    const double after = Cost(sigma);
    if (!(after < before)) {
      std::swap(state, state_);
      std::swap(linearized_, linearized_before_);
      damping *= 10;
      rejected = true;
      continue;
    }
    if (axis && before - after < kNegligible * std::max(1.0, after)) return;
    damping = std::max(1e-6, (std::exchange(rejected, false) ? 0.5 : 0.1) * damping);
  }
}

std::vector<char> TrackBundle::Outliers() const {
  constexpr double kMaxSigmas = 3;  // of the root mean square over the images
  const std::size_t others = state_.poses.size() - 1;
  const double threshold = kMaxSigmas * RobustSigma();
  const auto& [motions, residuals, visible, norms, sigma_px] = linearized_;
  std::vector<char> outliers;
  for (std::size_t at = 0; at < residuals.size(); at += others) {
    double squares = 0;
    for (std::size_t k = at; k < at + others; ++k)
      squares += visible[k] ? residuals[k].value.squaredNorm() : threshold * threshold;
    outliers.push_back(squares > threshold * threshold * static_cast<double>(others));
  }
  return outliers;
}

void TrackBundle::Remove(const std::vector<char>& removed) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (removed[i]) continue;
    corners_[kept] = corners_[i];
    state_.inverse_distances[kept++] = state_.inverse_distances[i];
  }
  corners_.resize(kept);
  state_.inverse_distances.resize(kept);
}

double TrackBundle::ReadoutSigma(Eigen::Index axis) {
  Reduce(RobustSigma());
  const Eigen::Index others = matrix_.rows() - 2;
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factored(
      Eigen::MatrixXd(matrix_.topLeftCorner(others, others)));
  const Eigen::VectorXd coupling = matrix_.row(others + axis).head(others);
  return 1 / std::sqrt(matrix_(others + axis, others + axis) - coupling.dot(factored.solve(coupling)));
}

std::vector<Eigen::Vector3d> TrackBundle::RotationRates() const {
  std::vector<Eigen::Vector3d> rates;
  for (const Twist& motion : linearized_.motions)
    rates.push_back(motion.tail<3>() + Eigen::Vector3d(-motion[1], motion[0], 0));
  return rates;
}

TrackBundle::ByLens TrackBundle::LensDerivatives(const Eigen::Vector2d& image_point) {
  const double x = image_point.x(), y = image_point.y(), r2 = image_point.squaredNorm();
  ByLens result;
  result << x, x, y, 1, 0, x * r2, 2 * x * y, r2 + 2 * x * x,  //
      y, -y, 0, 0, 1, y * r2, r2 + 2 * y * y, 2 * x * y;
  return result;
}

Eigen::Vector2d TrackBundle::ImagePoint(const Eigen::Vector2d& pixel) const {
  const CameraModel::Intrinsics& k = camera_->intrinsics();
  return {(pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy};
}

TrackBundle::Weights TrackBundle::WeightsOf(std::size_t k) const {
  const std::size_t n = state_.poses.size();
  const auto rate = [&](std::size_t from) { return 1 / (times_s_[from + 1] - times_s_[from]); };
  if (k == 0) return {{{0, -1.5 * rate(0)}, {1, 1.5 * rate(0) + 0.5 * rate(1)}, {2, -0.5 * rate(1)}}};
  if (k + 1 == n) {
    const double last = rate(n - 2), before = rate(n - 3);
    return {{{n - 1, 1.5 * last}, {n - 2, -1.5 * last - 0.5 * before}, {n - 3, 0.5 * before}}};
  }
  const double mean = 1 / (times_s_[k + 1] - times_s_[k - 1]);
  return {{{k + 1, mean}, {k - 1, -mean}, {k, 0}}};
}

void TrackBundle::UpdateMotions() {
  const auto mean = [&](std::size_t from, std::size_t to) -> Twist {
    return (state_.poses[to] * state_.poses[from].inverse()).Log() / (times_s_[to] - times_s_[from]);
  };
  const std::size_t n = state_.poses.size();
  std::vector<Twist>& motions = linearized_.motions;
  motions.resize(n);
  for (std::size_t k = 1; k + 1 < n; ++k) motions[k] = mean(k - 1, k + 1);
  motions.front() = 1.5 * mean(0, 1) - 0.5 * mean(1, 2);
  motions.back() = 1.5 * mean(n - 2, n - 1) - 0.5 * mean(n - 3, n - 2);
}

Eigen::Vector3d TrackBundle::Velocity(std::size_t k, const Eigen::Vector3d& point,
                                      double inverse_distance) const {
  const Twist& motion = linearized_.motions[k];
  return motion.tail<3>().cross(point) + inverse_distance * motion.head<3>();
}

double TrackBundle::Loss(double x) const {
  if (cauchy_) return kCauchyFactor * kCauchyFactor * std::log1p(std::pow(x / kCauchyFactor, 2));
  return x < kHuberFactor ? x * x : kHuberFactor * (2 * x - kHuberFactor);
}

double TrackBundle::LossWeight(double x) const {
  return cauchy_ ? 1 / (1 + std::pow(x / kCauchyFactor, 2)) : kHuberFactor / std::max(kHuberFactor, x);
}

TrackBundle::CornerInFirstImage TrackBundle::InFirstImage(const Corner& corner,
                                                          double inverse_distance) const {
  CornerInFirstImage first;
  first.position = camera_->ReadoutPosition(corner.seen->pixels.front().cast<double>());
  first.delay = state_.readout_s.dot(first.position);
  first.ray = corner.ray;
  first.ray.head<2>() -= corner.ray_by_lens * state_.lens;
  first.velocity = Velocity(0, first.ray, inverse_distance);
  first.middle = first.ray - first.delay * first.velocity;
  return first;
}

bool TrackBundle::Linearize(const Corner& corner, double inverse_distance, const CornerInFirstImage& first,
                            std::size_t k, Residual* out) const {
  const Rigid3& pose = state_.poses[k];
  const Twist& motion = linearized_.motions[k];
  const Eigen::Vector2d measured = corner.seen->pixels[k].cast<double>(),
                        position = camera_->ReadoutPosition(measured);
  const Eigen::Matrix3d rotation = pose.rotation.matrix();
  out->delay = state_.readout_s.dot(position);
  const Eigen::Vector3d point = rotation * first.middle + inverse_distance * pose.translation,
                        velocity = Velocity(k, point, inverse_distance);
  // At the exposure of the row, to second order in the rotation.
  const Eigen::Vector3d rotated = motion.tail<3>().cross(velocity),
                        exposed = point + out->delay * velocity + 0.5 * out->delay * out->delay * rotated;
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
  if (!camera_->Project(exposed, &pixel, &by_point)) return false;
  const double scale = std::ldexp(1.0, -corner.seen->level);
  ByLens by_lens = LensDerivatives(ImagePoint(pixel));
  by_lens.row(0) *= camera_->intrinsics().fx;
  by_lens.row(1) *= camera_->intrinsics().fy;
  pixel += by_lens * state_.lens;
  by_point *= scale;
  out->value = scale * (pixel - measured);
  out->by_pose << inverse_distance * by_point, -by_point * Hat(point);
  const Eigen::Matrix<double, 2, 3> by_middle = by_point * rotation;
  out->by_first_motion << -first.delay * inverse_distance * by_middle,
      first.delay * by_middle * Hat(first.ray);
  out->by_inverse_distance = by_point * (pose.translation + out->delay * motion.head<3>()) -
                             by_middle * (first.delay * linearized_.motions[0].head<3>());
  out->by_shared.leftCols<kLens>() = scale * by_lens - by_middle.leftCols<2>() * corner.ray_by_lens;
  out->by_shared.rightCols<2>() =
      by_point * velocity * position.transpose() - by_middle * first.velocity * first.position.transpose();
  return out->value.allFinite();
}

void TrackBundle::Linearize() {
  UpdateMotions();
  const std::size_t n = state_.poses.size();
  auto& [motions, residuals, visible, norms, sigma_px] = linearized_;
  residuals.resize(corners_.size() * (n - 1));
  visible.assign(residuals.size(), 0);
  norms.clear();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const double inverse_distance = state_.inverse_distances[i];
    const CornerInFirstImage first = InFirstImage(corners_[i], inverse_distance);
    for (std::size_t k = 1; k < n; ++k) {
      const std::size_t at = i * (n - 1) + k - 1;
      visible[at] = Linearize(corners_[i], inverse_distance, first, k, &residuals[at]) ? 1 : 0;
      if (visible[at]) norms.push_back(residuals[at].value.norm());
    }
  }
  // The median of a squared norm with two degrees of freedom is 2 ln 2 variances.
  sigma_px = Median(norms) / std::sqrt(2 * std::log(2.0));
}

void TrackBundle::CollectBlocks(std::size_t k, const Residual& residual) {
  blocks_.clear();
  const auto add = [&](std::size_t image, const Eigen::Matrix<double, 2, 6>& jacobian) {
    if (image == 0) return;
    for (PoseBlock& block : blocks_) {
      if (block.image != image) continue;
      block.jacobian += jacobian;
      return;
    }
    blocks_.push_back({image, jacobian});
  };
  add(k, residual.by_pose);
  for (const Weight& weight : weights_[k]) {
    if (weight.per_second != 0) add(weight.image, residual.delay * weight.per_second * residual.by_pose);
  }
  for (const Weight& weight : weights_[0]) add(weight.image, weight.per_second * residual.by_first_motion);
}

void TrackBundle::Reduce(double sigma) {
  const std::size_t n = state_.poses.size();
  const auto size = static_cast<Eigen::Index>(6 * (n - 1)) + kShared;
  matrix_.setZero(size, size);
  gradient_.setZero(size);
  couplings_.setZero(size, static_cast<Eigen::Index>(corners_.size()));
  hessians_.assign(corners_.size(), 1 / (kInverseDistanceSigma * kInverseDistanceSigma));
  gradients_.assign(corners_.size(), 0.0);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    gradients_[i] = hessians_[i] * (state_.inverse_distances[i] - 1);
    for (std::size_t k = 1; k < n; ++k) {
      const std::size_t at = i * (n - 1) + k - 1;
      if (!linearized_.visible[at]) continue;
      const Residual& r = linearized_.residuals[at];
      const double weight = LossWeight(r.value.norm() / sigma) / (sigma * sigma);
      CollectBlocks(k, r);
      for (const PoseBlock& block : blocks_) {
        const auto row = static_cast<Eigen::Index>(6 * (block.image - 1));
        const Eigen::Matrix<double, 6, 2> weighted = weight * block.jacobian.transpose();
        for (const PoseBlock& other : blocks_) {
          if (other.image > block.image) continue;
          const auto other_column = static_cast<Eigen::Index>(6 * (other.image - 1));
          matrix_.block<6, 6>(row, other_column).noalias() += weighted * other.jacobian;
        }
        matrix_.block<kShared, 6>(size - kShared, row).noalias() += (weighted * r.by_shared).transpose();
        gradient_.segment<6>(row).noalias() += weighted * r.value;
        couplings_.col(column).segment<6>(row).noalias() += weighted * r.by_inverse_distance;
      }
      matrix_.bottomRightCorner<kShared, kShared>().noalias() +=
          weight * r.by_shared.transpose() * r.by_shared;
      gradient_.tail<kShared>().noalias() += weight * r.by_shared.transpose() * r.value;
      couplings_.col(column).tail<kShared>().noalias() +=
          weight * r.by_shared.transpose() * r.by_inverse_distance;
      hessians_[i] += weight * r.by_inverse_distance.squaredNorm();
      gradients_[i] += weight * r.by_inverse_distance.dot(r.value);
    }
    gradient_ -= gradients_[i] / hessians_[i] * couplings_.col(column);
  }
  scaled_couplings_ = couplings_;
  for (std::size_t i = 0; i < corners_.size(); ++i)
    scaled_couplings_.col(static_cast<Eigen::Index>(i)) /= std::sqrt(hessians_[i]);
  matrix_.selfadjointView<Eigen::Lower>().rankUpdate(scaled_couplings_, -1);
  Eigen::Matrix<double, kShared, 1> present;
  present << state_.lens, state_.readout_s;
  matrix_.diagonal().tail<kShared>() += prior_;
  gradient_.tail<kShared>() += prior_.cwiseProduct(present);
}

void TrackBundle::Step(std::optional<Eigen::Index> axis, double damping) {
  const Eigen::Index poses = matrix_.rows() - 2;
  damped_ = matrix_;
  Eigen::VectorXd gradient = gradient_;
  damped_.diagonal() *= 1 + damping;
  for (Eigen::Index a = 0; a < 2; ++a) {
    if (axis == a) continue;
    damped_.row(poses + a).setZero();
    damped_.col(poses + a).setZero();
    damped_(poses + a, poses + a) = 1;
    gradient[poses + a] = 0;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factored(damped_);  // in place
  const Eigen::VectorXd step = -factored.solve(gradient);
  if (!step.allFinite()) return;
  for (std::size_t k = 1; k < state_.poses.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(6 * (k - 1));
    Rigid3& pose = state_.poses[k];
    const Rotation3 rotation = Rotation3::Exp(step.segment<3>(at + 3));
    pose = {rotation * pose.rotation, rotation * pose.translation + step.segment<3>(at)};
  }
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const double change =
        -(gradients_[i] + couplings_.col(static_cast<Eigen::Index>(i)).dot(step)) / hessians_[i];
    double& inverse = state_.inverse_distances[i];
    inverse = std::clamp(inverse + change, kMinInverseDistance, kMaxInverseDistance);
  }
  const double median = Median(state_.inverse_distances);
  for (double& inverse : state_.inverse_distances) inverse /= median;
  for (Rigid3& pose : state_.poses) pose.translation *= median;
  constexpr double kMaxStep_s = 0.02;
  state_.lens += step.segment<kLens>(poses - kLens);
  if (axis) state_.readout_s[*axis] += std::clamp(step[poses + *axis], -kMaxStep_s, kMaxStep_s);
}

}  // namespace docent::engine
