// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_adjustment.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "engine/mapping/bundle_system.h"
#include "engine/mapping/robust_loss.h"

namespace docent::engine {
namespace {

using Outcome = BundleSummary::Outcome;

// The robust threshold follows the residuals when they ask for less than this part of the one in use, and
// the descent goes on when at its end the two differ by more than the second.
constexpr double kThresholdDrop = 0.8;
constexpr double kThresholdChange = 0.1;
// The descent has arrived when a step changes the cost by less than this part of it, or the state by less
// than the second, or when no slope is left.
constexpr double kCostTolerance = 1e-6;
constexpr double kStepTolerance = 1e-9;
constexpr double kSlopeTolerance = 1e-10;
// Of the predicted decrease: what a step must keep.
constexpr double kLeastGain = 1e-3;

double RobustThreshold(const BundleOptions& options, double sigma) {
  return options.threshold_factor * std::max(options.min_sigma, sigma);
}

// How far the quadratic model is trusted, as the inverse of the damping (Nielsen, "Damping Parameter in
// Marquardt's Method", 1999).
class Trust {
 public:
  double damping() const { return 1 / radius_; }
  void Succeeded(double gain) {
    radius_ = std::min(kMost, radius_ / std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)));
    shrink_ = 2;
  }
  void Failed() {
    radius_ /= shrink_;
    shrink_ *= 2;
  }
  void StartAgain() {
    radius_ = std::max(kFirst, radius_);
    shrink_ = 2;
  }
  bool lost() const { return radius_ < kLeast; }

 private:
  static constexpr double kFirst = 1e4;
  // Beyond this the damping would vanish beside the curvature in double precision, and a point seen once
  // would be free along its ray.
  static constexpr double kMost = 1e8;
  static constexpr double kLeast = 1e-20;
  double radius_ = kFirst, shrink_ = 2;
};

class Descent {
 public:
  Descent(const BundleOptions& options, BundleSystem* system, BundleSummary* summary)
      : options_(options), system_(*system), summary_(*summary) {
    SetThreshold(Wanted());
  }

  Outcome Run() {
    if (system_.interrupted()) return Outcome::kInterrupted;
    if (system_.empty()) return Outcome::kConverged;
    while (summary_.iterations < options_.max_iterations) {
      const auto step = system_.Step(threshold_, trust_.damping());
      if (step == BundleSystem::Outcome::kInterrupted) return Outcome::kInterrupted;
      const bool flat = step == BundleSystem::Outcome::kDone && system_.steepest_slope() <= kSlopeTolerance;
      if (!flat) ++summary_.iterations;
      if (!(flat || Take(step))) continue;
      // Arrived under this threshold; another one may be due.
      const double wanted = Wanted();
      if (std::abs(wanted - threshold_) < kThresholdChange * threshold_) return Outcome::kConverged;
      SetThreshold(wanted);
      trust_.StartAgain();
    }
    return Outcome::kIterationLimit;
  }

 private:
  double Wanted() const { return RobustThreshold(options_, system_.Sigma()); }
  void SetThreshold(double threshold) {
    threshold_ = threshold;
    cost_ = RobustCost(options_.loss, threshold_, system_.squared_norms());
  }

  // Goes where the step leads if that is better; true at the end of the way.
  bool Take(BundleSystem::Outcome step) {
    if (step == BundleSystem::Outcome::kSingular) {
      trust_.Failed();
      return trust_.lost();
    }
    const double cost = RobustCost(options_.loss, threshold_, system_.next_squared_norms());
    const double decrease = cost_ - cost, gain = decrease / system_.predicted_decrease();
    const bool arrived =
        std::abs(decrease) <= kCostTolerance * cost_ || system_.relative_length() <= kStepTolerance;
    if (!(decrease > 0 && gain > kLeastGain)) {
      trust_.Failed();
      return arrived || trust_.lost();
    }
    system_.Accept();
    cost_ = cost;
    trust_.Succeeded(gain);
    if (!arrived) {
      if (const double wanted = Wanted(); wanted < kThresholdDrop * threshold_) SetThreshold(wanted);
    }
    return arrived;
  }

  const BundleOptions& options_;
  BundleSystem& system_;
  BundleSummary& summary_;
  Trust trust_;
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

const char* Name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kConverged:
      return "converged";
    case Outcome::kIterationLimit:
      return "stopped at the iteration limit";
    case Outcome::kInterrupted:
      return "interrupted";
    case Outcome::kFailed:
      return "failed";
  }
  return "unknown";
}

}  // namespace

std::string BundleSummary::Brief() const {
  char text[200];
  std::snprintf(text, sizeof(text),
                "%s after %d iterations, cost %.6g -> %.6g, sigma %.3f, %d outliers, %.1f ms", Name(outcome),
                iterations, initial_cost, final_cost, sigma, outliers, 1e3 * seconds);
  return text;
}

BundleSummary AdjustBundle(const BundleOptions& options, BundleProblem* problem) {
  const auto begin = std::chrono::steady_clock::now();
  BundleSummary summary;
  BundleSystem system(*problem, options.loss, options.interrupt);
  summary.outcome = Descent(options, &system, &summary).Run();
  summary.sigma = system.Sigma();
  const std::vector<double>& start_norms = system.MeasureAgain(*problem);
  double threshold = RobustThreshold(options, summary.sigma);
  // Both under the same threshold: otherwise a tighter one alone would look like progress.
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
