// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/mapping/two_view_consensus.h"

// Choosing between models and between the poses that a model allows. Pure functions; any thread.
namespace docent::engine {

enum class ModelKind { kRotation, kHomography, kEssential };

// Standard deviation of an image coordinate, pixels, from the residuals that the best-fitting essential
// matrix leaves on its inliers: the loosest of the three models shows the noise alone.
double EstimateScatter(const RayPairs& pairs, const Consensus& essential, double inlier_px);

// The model with the lowest geometric robust information criterion (Torr 1998: GRIC), which weighs what a
// model leaves unexplained against its dimension (2, 2, 3 of the 4 coordinates of a pair) and parameters (3,
// 8, 5).
ModelKind SelectModel(const Consensus& rotation, const Consensus& homography, const Consensus& essential,
                      double inlier_px, double noise_px);

// Where along both rays a pair meets under a pose.
enum class Depth { kInFront, kBehind, kTooFar };
// kTooFar: the rays, turned into one frame, differ by less than min_parallax_px.
std::vector<Depth> JudgeDepths(const RayPairs& pairs, const Rigid3& b_from_a, double min_parallax_px);

// A pose and what speaks against it, in squared residuals over the squared noise, truncated; a pair that
// meets behind a camera costs as much as an outlier.
struct PoseCandidate {
  Rigid3 b_from_a;
  double misfit = 0;    // of all pairs
  double evidence = 0;  // the same, but a pair on the plane counts only where it meets behind a camera: every
                        // reading of a homography explains those equally, and only noise tells them apart
  bool reading =
      true;  // one of the exact readings of the matrix that fits, not a variant refined for accuracy
};

// The poses that the two models allow, |translation| = 1, best first. The homography's poses take part where
// it explains at least half of what the essential matrix does.
std::vector<PoseCandidate> RankPoses(const RayPairs& pairs, const Consensus& homography,
                                     const Consensus& essential, double inlier_px, double noise_px);

// Whether a reading that is not merely a variant of the best pose explains the pairs nearly as well.
bool IsAmbiguous(const std::vector<PoseCandidate>& ranked);

}  // namespace docent::engine
