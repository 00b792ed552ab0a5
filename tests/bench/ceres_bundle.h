// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/mapping/bundle/bundle_adjustment.h"

// The problems of engine::AdjustBundle solved by Ceres, to compare the two. Ceres gets what makes it fast
// here: analytic Jacobians by the six components of a twist, the points as the first group of the
// elimination, and sparse or dense Cholesky factorization of the reduced camera system. It uses one thread,
// and stops at the same tolerances as AdjustBundle.
namespace docent::bench {

struct CeresOptions {
  engine::RobustLoss loss = engine::RobustLoss::kTukey;
  double threshold = 1;  // of the robust loss, constant, in sigmas
  int max_iterations = 10;
  bool sparse = false;
};

struct CeresSummary {
  double prepare_ms = 0;  // until the problem is built; included in the time of SolveWithCeres
  int iterations = 0;
};

// Adjusts the free cameras and points in place.
CeresSummary SolveWithCeres(const CeresOptions& options, engine::BundleProblem* problem);

}  // namespace docent::bench
