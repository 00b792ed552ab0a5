// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/bundle_adjustment.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine/base/option_check.h"
#include "engine/mapping/bundle/bundle_system.h"
#include "engine/mapping/bundle/robust_loss.h"

namespace docent::engine {
namespace {

using Outcome = BundleSummary::Outcome;

// The robust threshold is lowered as soon as the residuals ask for less than this ratio of the current one;
// and the descent continues if, at its end, the two differ by more than the second ratio.
constexpr double kThresholdDrop = 0.8;
constexpr double kThresholdChange = 0.1;
// The descent has converged if a step changes the cost by less than this ratio, or the state by less than the
// second, or if no component of the gradient is larger than the third.
constexpr double kCostTolerance = 1e-6;
constexpr double kStepTolerance = 1e-9;
constexpr double kGradientTolerance = 1e-10;
// A step is accepted if it achieves at least this ratio of the predicted decrease.
constexpr double kMinGain = 1e-3;

double RobustThreshold(const BundleOptions& options, double sigma) {
  return options.threshold_factor * std::max(options.min_sigma, sigma);
}

// The radius within which the quadratic model is trusted, as the inverse of the damping (Nielsen, "Damping
// Parameter in Marquardt's Method", 1999).
class TrustRegion {
 public:
  double damping() const { return 1 / radius_; }
  void Expand(double gain) {
    radius_ = std::min(kMaxRadius, radius_ / std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)));
    shrink_ = 2;
  }
  void Shrink() {
    radius_ /= shrink_;
    shrink_ *= 2;
  }
  void Restart() {
    radius_ = std::max(kInitialRadius, radius_);
    shrink_ = 2;
  }
  bool exhausted() const { return radius_ < kMinRadius; }

 private:
  static constexpr double kInitialRadius = 1e4;
  // Beyond this the damping would vanish beside the curvature in double precision, and a point with a single
  // observation would be free along its ray.
  static constexpr double kMaxRadius = 1e8;
  static constexpr double kMinRadius = 1e-20;
  double radius_ = kInitialRadius, shrink_ = 2;
};

class Descent {
 public:
  Descent(const BundleOptions& options, BundleSystem* system, BundleSummary* summary)
      : options_(options), system_(*system), summary_(*summary) {
    SetThreshold(DesiredThreshold());
  }

  Outcome Run() {
    if (system_.interrupted()) return Outcome::kInterrupted;
    if (system_.empty()) return Outcome::kConverged;
    while (summary_.iterations < options_.max_iterations) {
      const auto step = system_.Step(threshold_, region_.damping());
      if (step == BundleSystem::Outcome::kInterrupted) return Outcome::kInterrupted;
      const bool stationary =
          step == BundleSystem::Outcome::kDone && system_.max_gradient() <= kGradientTolerance;
      if (!stationary) ++summary_.iterations;
      if (!(stationary || TakeStep(step))) continue;
      // The descent has converged under this threshold; the residuals may now ask for another one.
      const double desired = DesiredThreshold();
      if (std::abs(desired - threshold_) < kThresholdChange * threshold_) return Outcome::kConverged;
      SetThreshold(desired);
      region_.Restart();
    }
    return Outcome::kIterationLimit;
  }

 private:
  double DesiredThreshold() const { return RobustThreshold(options_, system_.Sigma()); }
  void SetThreshold(double threshold) {
    threshold_ = threshold;
    cost_ = RobustCost(options_.loss, threshold_, system_.squared_norms());
  }

  // Accepts the step if it reduces the cost; returns true if the descent has converged or cannot continue.
  bool TakeStep(BundleSystem::Outcome step) {
    if (step == BundleSystem::Outcome::kSingular) {
      region_.Shrink();
      return region_.exhausted();
    }
    const double cost = RobustCost(options_.loss, threshold_, system_.next_squared_norms());
    const double decrease = cost_ - cost, gain = decrease / system_.predicted_decrease();
    const bool converged =
        std::abs(decrease) <= kCostTolerance * cost_ || system_.relative_length() <= kStepTolerance;
    if (!(decrease > 0 && gain > kMinGain)) {
      region_.Shrink();
      return converged || region_.exhausted();
    }
    system_.Accept();
    cost_ = cost;
    region_.Expand(gain);
    if (!converged) {
      if (const double desired = DesiredThreshold(); desired < kThresholdDrop * threshold_)
        SetThreshold(desired);
    }
    return converged;
  }

  const BundleOptions& options_;
  BundleSystem& system_;
  BundleSummary& summary_;
  TrustRegion region_;
  double threshold_ = 0, cost_ = 0;
};

void MarkOutliers(double threshold, const BundleSystem& system, const std::vector<double>& squared_norms,
                  BundleProblem* problem, BundleSummary* summary) {
  summary->outliers = 0;
  for (std::size_t i = 0; i < squared_norms.size(); ++i) {
    const bool outlier = !(squared_norms[i] < threshold * threshold);
    problem->measurements[static_cast<std::size_t>(system.measurement_index(i))].outlier = outlier;
    summary->outliers += outlier ? 1 : 0;
  }
}

}  // namespace

std::optional<std::string> BundleOptions::Validate() const {
  return OptionCheck()
      .AtLeast(max_iterations, 0, "number of iterations of a bundle adjustment")
      .Positive(threshold_factor, "factor of the robust threshold of a bundle adjustment")
      .Positive(min_sigma, "smallest sigma of the residuals of a bundle adjustment")
      .fault();
}

BundleSummary AdjustBundle(const BundleOptions& options, BundleProblem* problem) {
  Checked(options);
  const auto begin = std::chrono::steady_clock::now();
  BundleSummary summary;
  BundleSystem system(*problem, options.loss, options.interrupt);
  summary.outcome = Descent(options, &system, &summary).Run();
  summary.sigma = system.Sigma();
  const std::vector<double>& start_norms = system.EvaluateAt(*problem);
  double threshold = RobustThreshold(options, summary.sigma);
  // Both costs use the same threshold: otherwise a lower threshold alone would look like progress.
  summary.initial_cost = RobustCost(options.loss, threshold, start_norms);
  summary.final_cost = RobustCost(options.loss, threshold, system.squared_norms());
  if (summary.final_cost <= summary.initial_cost) {
    system.WriteBack(problem);
    MarkOutliers(threshold, system, system.squared_norms(), problem, &summary);
  } else {
    summary.final_cost = summary.initial_cost;
    summary.sigma = EstimateSigma(start_norms);
    threshold = RobustThreshold(options, summary.sigma);
    MarkOutliers(threshold, system, start_norms, problem, &summary);
  }
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

}  // namespace docent::engine
