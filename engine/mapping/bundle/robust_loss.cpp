// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/robust_loss.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace docent::engine {
namespace {

// Median of the norm of a two-dimensional normal variable, in standard deviations: sqrt(2 ln 2).
constexpr double kRayleighMedian = 1.1774100225154747;
// Residual, in units of the threshold, that Huber's loss assigns to a measurement that does not project.
constexpr double kUnprojectableThresholds = 10;

}  // namespace

RobustValue EvaluateLoss(RobustLoss loss, double threshold, double squared_residual) {
  const double squared_threshold = threshold * threshold;
  if (loss == RobustLoss::kTukey) {
    if (squared_residual >= squared_threshold) {
      return {squared_threshold / 3, 0};
    }
    const double u = 1 - squared_residual / squared_threshold;
    return {squared_threshold / 3 * (1 - u * u * u), u * u};
  }
  if (squared_residual <= squared_threshold) {
    return {squared_residual, 1};
  }
  const double residual = std::sqrt(squared_residual);
  return {2 * threshold * residual - squared_threshold, threshold / residual};
}

double CostOfUnprojectable(RobustLoss loss, double threshold) {
  const double residual = kUnprojectableThresholds * threshold;
  return EvaluateLoss(loss, threshold, residual * residual).cost;
}

double RobustCost(RobustLoss loss, double threshold, const std::vector<double>& squared_norms) {
  double sum = 0;
  for (const double squared_norm : squared_norms) {
    sum += std::isfinite(squared_norm) ? EvaluateLoss(loss, threshold, squared_norm).cost
                                       : CostOfUnprojectable(loss, threshold);
  }
  return 0.5 * sum;
}

double EstimateSigma(const std::vector<double>& squared_norms) {
  std::vector<double> scratch;
  return EstimateSigma(squared_norms, &scratch);
}

double EstimateSigma(const std::vector<double>& squared_norms, std::vector<double>* scratch) {
  if (scratch->size() < squared_norms.size()) scratch->resize(squared_norms.size());
  const auto begin = scratch->begin();
  const auto end = std::copy_if(squared_norms.begin(), squared_norms.end(), begin,
                                [](double norm) { return std::isfinite(norm); });
  if (begin == end) return 0;
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end);
  return std::sqrt(*middle) / kRayleighMedian;
}

}  // namespace docent::engine
