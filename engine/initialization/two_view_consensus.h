// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "engine/initialization/two_view_models.h"

// Robust estimation of one two-view model from ray pairs with outliers: random sampling with a truncated
// quadratic score (MSAC, Torr and Zisserman 2000) and local optimization of every new best model (LO-RANSAC,
// Chum, Matas and Kittler 2003). Deterministic under the seed; any thread.
namespace docent::engine {

struct ConsensusOptions {
  double inlier_px = 1.5;  // Sampson residual
  int max_iterations = 300;
  double confidence = 0.999;
  // Smaller consensus sets are of no interest: the sampling ends once a set of this size would have been
  // found.
  int min_inliers = 0;
  std::uint64_t seed = 1;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

struct Consensus {
  bool found = false;
  Eigen::Matrix3d model = Eigen::Matrix3d::Identity();
  Eigen::ArrayXd squared_px;  // residuals of all pairs
  double cost = 0;            // truncated sum of squares, pixels squared
  int inliers = 0;
};

// Minimal samples: two pairs (rotation), four (homography), five (essential matrix).
Consensus FindRotation(const RayPairs& pairs, const ConsensusOptions& options);
Consensus FindHomography(const RayPairs& pairs, const ConsensusOptions& options);
Consensus FindEssential(const RayPairs& pairs, const ConsensusOptions& options);

// Optimizes a pose locally and replaces *best if its cost is lower.
void OfferPose(const RayPairs& pairs, const ConsensusOptions& options, const Rigid3& b_from_a,
               Consensus* best);

}  // namespace docent::engine
