// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/two_view_selection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/median.h"
#include "engine/base/stable_sort.h"
#include "engine/initialization/five_point.h"
#include "engine/initialization/homography.h"

namespace docent::engine {
namespace {

// Truncation of the squared normalized residuals of poses: two standard deviations.
constexpr double kMaxSquared = 4.0;

// A pair has two constraints instead of one: factor to the radius that contains the same share of a normal
// distribution.
constexpr double kSigmaOfTwoDimensions = 1.25;

struct Evidence {
  Weights counted, on_plane;  // 0 or 1 per pair
  double noise_px = 1;
};

PoseCandidate EvaluatePose(const RayPairs& pairs, const Evidence& evidence, const Rigid3& b_from_a) {
  // Standard deviations of the noise; with less parallax, front and behind cannot be distinguished.
  constexpr double kMinParallaxSigmas = 4;
  const Eigen::ArrayXd squared =
      EssentialResiduals(pairs, EssentialFromPose(b_from_a)) / (evidence.noise_px * evidence.noise_px);
  const std::vector<Depth> depths = ClassifyDepths(pairs, b_from_a, kMinParallaxSigmas * evidence.noise_px);
  PoseCandidate candidate{.b_from_a = b_from_a};
  for (Eigen::Index i = 0; i < pairs.size(); ++i) {
    if (evidence.counted[i] == 0) continue;
    const bool behind = depths[static_cast<std::size_t>(i)] == Depth::kBehind;
    const double cost = behind ? kMaxSquared : std::min(squared[i], kMaxSquared);
    candidate.cost += cost;
    if (behind || evidence.on_plane[i] == 0) candidate.off_plane_cost += cost;
  }
  return candidate;
}

double Gric(const Consensus& consensus, const Weights& counted, double noise_px, int dimension,
            int parameters) {
  constexpr double kDataDimension = 4, kTruncation = 2;  // r and lambda_3 of the paper
  if (!consensus.found) return std::numeric_limits<double>::infinity();
  const double count = counted.sum();
  const double limit = kTruncation * (kDataDimension - dimension);
  const Eigen::ArrayXd normalized = consensus.squared_px / (noise_px * noise_px);
  const double cost = (counted * (normalized < limit).select(normalized, limit)).sum();
  return cost + std::log(kDataDimension) * dimension * count + std::log(kDataDimension * count) * parameters;
}

bool IsVariant(const Rigid3& a, const Rigid3& b) {
  constexpr double kMaxRotation = 0.026, kMinCosine = 0.94;  // 1.5 and 20 degrees
  return (a.rotation.inverse() * b.rotation).Angle() < kMaxRotation &&
         a.translation.dot(b.translation) > kMinCosine;
}

}  // namespace

double EstimateScatter(const RayPairs& pairs, const Consensus& essential, double inlier_px) {
  std::vector<double> squared;
  for (Eigen::Index i = 0; i < pairs.size(); ++i)
    if (essential.squared_px[i] < inlier_px * inlier_px) squared.push_back(essential.squared_px[i]);
  // The median of a squared normal variable is 0.455 of its variance.
  return std::sqrt(Median(std::move(squared)) / 0.455);
}

ModelKind SelectModel(const Consensus& rotation, const Consensus& homography, const Consensus& essential,
                      double inlier_px, double noise_px) {
  Weights counted = Weights::Zero(essential.squared_px.size());
  for (const Consensus* consensus : {&rotation, &homography, &essential})
    if (consensus->found)
      counted = counted.max((consensus->squared_px < inlier_px * inlier_px).cast<double>());
  // Assumes somewhat more noise than estimated, so that small errors of a lens model, and an estimate that
  // the truncation made too low, do not look like structure. Real depth exceeds any of this.
  constexpr double kNoiseMargin = 1.25;
  const double noise = kNoiseMargin * noise_px;
  const double of_rotation = Gric(rotation, counted, noise, 2, 3);
  const double of_homography = Gric(homography, counted, noise, 2, 8);
  const double of_essential = Gric(essential, counted, noise, 3, 5);
  if (of_rotation <= of_homography && of_rotation <= of_essential) return ModelKind::kRotation;
  return of_homography <= of_essential ? ModelKind::kHomography : ModelKind::kEssential;
}

std::vector<Depth> ClassifyDepths(const RayPairs& pairs, const Rigid3& b_from_a, double min_parallax_px) {
  std::vector<Depth> depths(static_cast<std::size_t>(pairs.size()), Depth::kTooFar);
  const Eigen::Matrix3d rotation = b_from_a.rotation.matrix();
  const double min_parallax = min_parallax_px * pairs.pixel_angle;
  for (Eigen::Index i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d rotated = rotation * pairs.RayA(i), ray_b = pairs.RayB(i);
    if ((rotated - ray_b).squaredNorm() < min_parallax * min_parallax) continue;
    // depth_b * ray_b = depth_a * rotated + translation, solved by crossing with either ray.
    const Eigen::Vector3d normal = rotated.cross(ray_b);
    const double depth_a = ray_b.cross(b_from_a.translation).dot(normal);
    const double depth_b = rotated.cross(b_from_a.translation).dot(normal);
    depths[static_cast<std::size_t>(i)] = depth_a > 0 && depth_b > 0 ? Depth::kInFront : Depth::kBehind;
  }
  return depths;
}

std::vector<PoseCandidate> RankPoses(const RayPairs& pairs, const Consensus& homography,
                                     const Consensus& essential, double inlier_px, double noise_px) {
  const double limit = inlier_px * inlier_px;
  constexpr int kIterations = 10;
  const Weights essential_inliers = (essential.squared_px < limit).cast<double>();
  Evidence evidence{essential_inliers, Weights::Zero(pairs.size()), noise_px};
  std::vector<PoseCandidate> candidates;
  // Whether refined or not, all poses of one essential matrix have equal residuals; cheirality distinguishes
  // them.
  const auto add_all = [&](const Rigid3& pose, bool exact) {
    for (const Rigid3& variant : PosesFromEssential(EssentialFromPose(pose))) {
      candidates.push_back(EvaluatePose(pairs, evidence, variant));
      candidates.back().exact = exact;
    }
  };
  const bool plane = homography.found && 2 * homography.inliers >= essential.inliers;

  if (plane) {
    const double plane_px = kSigmaOfTwoDimensions * inlier_px;
    Eigen::Matrix3d refined = homography.model;
    Eigen::ArrayXd plane_squared = homography.squared_px;
    Weights plane_inliers;
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      plane_inliers = (plane_squared < plane_px * plane_px).cast<double>();
      refined = RefineHomography(pairs, plane_inliers, refined, inlier_px, kIterations);
      plane_squared = HomographyResiduals(pairs, refined);
    }
    evidence.counted = evidence.counted.max(plane_inliers);
    // Wide enough that noise puts no point of the plane off it: among such points the winning essential
    // matrix has selected those that happen to agree with it.
    constexpr double kOffPlaneSigmas = 3.7;  // standard deviations; exceeded by one in a thousand
    const double off_plane_px = std::max(plane_px, kOffPlaneSigmas * noise_px);
    evidence.on_plane = (plane_squared < off_plane_px * off_plane_px).cast<double>();
    if (const auto scaled = ScaleHomography(refined)) {
      const auto motions = DecomposeHomography(*scaled);
      for (std::size_t i = 0; i < motions.size(); i += 2) {  // motions come in pairs that differ only in sign
        const double length = motions[i].b_from_a.translation.norm();
        if (!(length > 1e-9)) continue;
        const Rigid3 pose{motions[i].b_from_a.rotation, motions[i].b_from_a.translation / length};
        add_all(pose, true);
        add_all(RefinePose(pairs, evidence.counted, pose, inlier_px, kIterations), false);
      }
    }
  }
  add_all(
      RefinePose(pairs, essential_inliers, PosesFromEssential(essential.model)[0], inlier_px, kIterations),
      !plane);

  StableSort(&candidates, [](const PoseCandidate& a, const PoseCandidate& b) { return a.cost < b.cost; });
  return candidates;
}

bool IsAmbiguous(const std::vector<PoseCandidate>& ranked) {
  // In units of twice the log-likelihood. The constants guard against chance, the ratios against a lens model
  // whose small errors systematically favour one pose.
  constexpr double kMinEvidence = 40, kMinEvidenceRatio = 0.1, kChanceDeviations = 5, kCostRatio = 0.4;
  const PoseCandidate& best = ranked.front();
  const double evidence =
      best.off_plane_cost + std::max(kMinEvidence, kMinEvidenceRatio * best.off_plane_cost);
  // The noise of the plane's points differs between two epipolar directions: a sum of independent terms.
  const double cost =
      best.cost + std::max(kChanceDeviations * std::sqrt(2 * best.cost), kCostRatio * best.cost);
  return std::any_of(ranked.begin() + 1, ranked.end(), [&](const PoseCandidate& other) {
    return other.exact && other.off_plane_cost < evidence && other.cost < cost &&
           !IsVariant(other.b_from_a, best.b_from_a);
  });
}

}  // namespace docent::engine
