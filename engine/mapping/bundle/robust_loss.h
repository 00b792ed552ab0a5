// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/mapping/bundle/bundle_adjustment.h"

// Robust losses of squared residuals, for bundle adjustment (ptamm §2.3).
namespace docent::engine {

// A concave loss rho of a squared residual s, and its slope. Concave means rho(s) >= s * slope(s): a step
// that reduces the weighted squares reduces the loss.
struct RobustValue {
  double cost = 0;  // rho(s)
  // rho'(s): the weight of iteratively reweighted least squares; 0 beyond Tukey's threshold.
  double slope = 1;
};
RobustValue EvaluateLoss(RobustLoss loss, double threshold, double squared_residual);
// The cost of a measurement that cannot be projected: that of a gross outlier.
double CostOfUnprojectable(RobustLoss loss, double threshold);

// Half the sum of the losses of squared norms. Norms that are not finite stand for measurements that do not
// project.
double RobustCost(RobustLoss loss, double threshold, const std::vector<double>& squared_norms);

// Standard deviation per axis of two-dimensional residuals, from the median of their squared norms.
// Measurements that do not project (infinite) are left out. Zero if there are none.
double EstimateSigma(const std::vector<double>& squared_norms);
// The same without allocation if *scratch is large enough; its values are overwritten.
double EstimateSigma(const std::vector<double>& squared_norms, std::vector<double>* scratch);

}  // namespace docent::engine
