// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/initialization/two_view_consensus.h"

// Selects between two-view models, and between the poses that a model allows. Pure functions; any thread.
namespace docent::engine {

enum class ModelKind { kRotation, kHomography, kEssential };

// Standard deviation of an image coordinate, in pixels, from the inlier residuals of the best essential
// matrix. It is the most flexible of the three models, so its residuals contain noise only.
double EstimateScatter(const RayPairs& pairs, const Consensus& essential, double inlier_px);

// The model with the lowest geometric robust information criterion (Torr 1998: GRIC), which weighs the
// residuals of a model against its dimension (2, 2, 3 of the 4 coordinates of a pair) and its number of
// parameters (3, 8, 5).
ModelKind SelectModel(const Consensus& rotation, const Consensus& homography, const Consensus& essential,
                      double inlier_px, double noise_px);

// Position of the intersection of a pair's rays under a pose.
enum class Depth { kInFront, kBehind, kTooFar };
// kTooFar: the rays, rotated into one frame, differ by less than min_parallax_px.
std::vector<Depth> ClassifyDepths(const RayPairs& pairs, const Rigid3& b_from_a, double min_parallax_px);

// A pose and its cost: the sum of squared residuals over the squared noise, truncated. A pair that intersects
// behind a camera costs as much as an outlier.
struct PoseCandidate {
  Rigid3 b_from_a;
  double cost = 0;  // over all pairs
  // The same, but a pair on the plane counts only if it intersects behind a camera: every decomposition of a
  // homography explains such pairs equally well, and only noise distinguishes them.
  double off_plane_cost = 0;
  bool exact = true;  // an exact decomposition of the model, not a variant refined for accuracy
};

// The poses that the two models allow, |translation| = 1, lowest cost first. The poses of the homography are
// included if it has at least half as many inliers as the essential matrix.
std::vector<PoseCandidate> RankPoses(const RayPairs& pairs, const Consensus& homography,
                                     const Consensus& essential, double inlier_px, double noise_px);

// True if another exact decomposition, not merely a variant of the best pose, explains the pairs nearly as
// well.
bool IsAmbiguous(const std::vector<PoseCandidate>& ranked);

}  // namespace docent::engine
