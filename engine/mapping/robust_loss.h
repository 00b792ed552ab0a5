// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/mapping/bundle_adjustment.h"

// Robust losses of squared residuals, for bundle adjustment (ptamm §2.3).
namespace docent::engine {

// A concave loss rho of a squared residual s, and its slope. Concave means rho(s) >= s * slope(s): a step
// that the weighted squares welcome is welcomed by the loss.
struct RobustValue {
  double cost = 0;  // rho(s)
  double slope =
      1;  // rho'(s), the weight of iteratively reweighted least squares; 0 beyond Tukey's threshold
};
RobustValue EvaluateLoss(RobustLoss loss, double threshold, double squared_residual);
// What a measurement costs that cannot be projected: as much as any gross outlier, wherever it would fall.
double CostOfUnprojectable(RobustLoss loss, double threshold);

// Half the sum of the losses of squared norms, of which those that are not finite stand for measurements that
// do not project.
double RobustCost(RobustLoss loss, double threshold, const std::vector<double>& squared_norms);

// Standard deviation per axis of two-dimensional residuals from the median of their squared norms;
// measurements that do not project (infinite) are left out. Zero without any.
double EstimateSigma(const std::vector<double>& squared_norms);
// The same in memory that is there already: *scratch, whose numbers are lost and whose size stays.
double EstimateSigma(const std::vector<double>& squared_norms, std::vector<double>* scratch);

}  // namespace docent::engine
