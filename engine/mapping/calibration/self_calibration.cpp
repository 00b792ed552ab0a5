// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/self_calibration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/mapping/calibration/lens_uncertainty.h"

namespace docent::engine {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Both have 95 % efficiency under Gaussian noise (as in BundleOptions).
constexpr double kTukeyFactor = 4.685, kHuberFactor = 1.345;
constexpr double kMinSigma = 0.4;
// Fewer measurements leave little redundancy for a lens in addition to the poses of eight keyframes.
constexpr std::size_t kMinMeasurements = 100;
constexpr double kLensCostTolerance = 1e-7;
// Tangents of half the field of view: results outside 6 to 150 degrees are rejected.
constexpr double kMaxHalfTangent = 3.73, kMinHalfTangent = 0.052;

class Calibrator {
 public:
  Calibrator(const SelfCalibrationOptions& options, const std::vector<char>& unknown,
             const BundleProblem& problem)
      : options_(options), bundle_(options, unknown, problem), state_(bundle_.begin()) {}

  SelfCalibration Run() {
    SelfCalibration result;
    if (!bundle_.HasUnknownCamera() || bundle_.size() < kMinMeasurements) return result;
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
    if (!LensIsPlausible() || !EstimateUncertainty(threshold, &result)) return result;
    result.focal_px = state_.lens.focal();
    result.lens = Model();
    RestoreScale();
    result.outcome = SelfCalibration::Outcome::kDone;
    return result;
  }

  void WriteBack(BundleProblem* problem) const {
    const auto lens = std::make_shared<const CameraModel>(Model());
    for (std::size_t i = 0; i < problem->cameras.size(); ++i) {
      BundleProblem::Camera& camera = problem->cameras[i];
      camera.camera_from_map = state_.poses[i];
      if (bundle_.IsUnknown(i) && options_.refine_lens)
        camera.model = CameraModel::WithMotionOf(*camera.model, lens);
    }
    for (std::size_t i = 0; i < problem->points.size(); ++i) problem->points[i].position = state_.points[i];
    const double sigma = EstimateSigma(norms_);
    const double threshold = kTukeyFactor * std::max(kMinSigma, sigma);
    for (std::size_t i = 0; i < bundle_.size(); ++i)
      problem->measurements[bundle_.measurement_index(i)].outlier = !(norms_[i] < threshold * threshold);
  }

 private:
  bool interrupted() const {
    return options_.interrupt != nullptr && options_.interrupt->load(std::memory_order_relaxed);
  }
  CameraModel Model() const { return state_.lens.Model(bundle_.width_px(), bundle_.height_px()); }

  void Descend(RobustLoss loss, double factor, int most) {
    norms_ = bundle_.Norms(state_);
    const auto wanted = [&] { return factor * std::max(kMinSigma, EstimateSigma(norms_)); };
    double threshold = wanted(), damping = 1e-4, grow = 2;
    const auto cost_of = [&](const LensBundleState& state, const std::vector<double>& norms) {
      return RobustCost(loss, threshold, norms) + bundle_.PriorCost(state.lens);
    };
    double cost = cost_of(state_, norms_);
    LensBundle::Reduced reduced;
    for (int iteration = 0; iteration < most && !interrupted(); ++iteration) {
      ++iterations_;
      bundle_.Linearize(state_, norms_, loss, threshold, damping, &reduced);
      const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factored(reduced.matrix);
      bool arrived = false, better = false;
      if (factored.info() == Eigen::Success) {
        const Eigen::VectorXd step = -factored.solve(reduced.gradient);
        // The linearization does not hold for a larger relative change of the focal length.
        constexpr double kMaxFocalStep = 0.25;
        if (step.allFinite() && std::abs(step[step.size() - LensParameters::kCount]) < kMaxFocalStep) {
          LensBundleState next = bundle_.Step(state_, norms_, loss, threshold, reduced, step);
          std::vector<double> norms = bundle_.Norms(next);
          const double next_cost = cost_of(next, norms);
          better = next_cost < cost;
          arrived = std::abs(cost - next_cost) <= kLensCostTolerance * cost && damping < 1;
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
  LensBundleState WithFocalLength(const LensBundleState& from, double focal) const {
    LensBundleState to = from;
    const double focal_ratio = focal / from.lens.focal();
    to.lens.values = bundle_.expected();
    to.lens.values[0] = std::log(focal);
    const Rigid3& anchor = from.poses[bundle_.anchor()];
    const Eigen::Vector3d stretch(1, 1, focal_ratio);
    for (std::size_t i = 0; i < to.poses.size(); ++i) {
      const Rigid3 camera_from_anchor = from.poses[i] * anchor.inverse();
      Eigen::Vector3d rotation_vector = camera_from_anchor.rotation.Log();
      if (bundle_.IsUnknown(i)) rotation_vector.head<2>() /= focal_ratio;
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
    const LensBundleState& begin = bundle_.begin();
    struct Trial {
      LensBundleState state;
      std::vector<double> norms;
    };
    std::vector<Trial> trials;
    std::vector<double> focals = {begin.lens.focal()};
    for (const double degrees : options_.fields_of_view_deg) {
      const double focal =
          LensWithFieldOfView(bundle_.width_px(), bundle_.height_px(), degrees).intrinsics().fx;
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
    const double tangent = 0.5 * std::max(bundle_.width_px(), bundle_.height_px()) / state_.lens.focal();
    if (!(tangent > kMinHalfTangent && tangent < kMaxHalfTangent) || !state_.lens.values.allFinite())
      return false;
    const CameraModel lens = Model();
    return !CameraModel::Validate(lens.lens(), lens.intrinsics(), lens.distortion()).has_value();
  }

  bool EstimateUncertainty(double threshold, SelfCalibration* result) {
    if (!options_.refine_lens) return true;
    const auto estimated = EstimateLensUncertainty(state_, norms_, threshold, result->sigma, &bundle_);
    if (!estimated) return false;
    result->focal_sigma = estimated->focal_sigma;
    result->k1_sigma = estimated->k1_sigma;
    result->formal_focal_sigma = estimated->formal_focal_sigma;
    return true;
  }

  // Scales the result so that the points seen by the anchor keep their median distance from its optical axis.
  void RestoreScale() {
    const LensBundleState& begin = bundle_.begin();
    const std::size_t anchor = bundle_.anchor();
    std::vector<double> ratios;
    for (std::size_t i = 0; i < bundle_.size(); ++i) {
      if (static_cast<std::size_t>(bundle_.At(i).camera) != anchor) continue;
      const auto p = static_cast<std::size_t>(bundle_.At(i).point);
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
  LensBundle bundle_;
  LensBundleState state_;
  std::vector<double> norms_;  // of state_
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
