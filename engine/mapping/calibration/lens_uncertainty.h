// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "engine/mapping/calibration/lens_bundle.h"

namespace docent::engine {

// Standard deviations of an estimated lens; see SelfCalibration.
struct LensUncertainty {
  double focal_sigma = 0, k1_sigma = 0;
  double formal_focal_sigma = 0;
};

// Computes them at a minimum of the cost with Tukey's loss and this threshold, from the influence of each
// measurement on the lens in the linearized equations: sums over points and over keyframes account for
// correlated errors. norms: of the state. sigma: robust standard deviation of the residuals along one axis.
// Empty if the measurements do not determine the lens.
std::optional<LensUncertainty> EstimateLensUncertainty(const LensBundleState& state,
                                                       const std::vector<double>& norms, double threshold,
                                                       double sigma, LensBundle* bundle);

}  // namespace docent::engine
