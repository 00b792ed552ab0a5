// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/two_view_consensus.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/base/random.h"
#include "engine/initialization/five_point.h"
#include "engine/initialization/homography.h"

namespace docent::engine {
namespace {

constexpr int kLocalRounds = 2;
constexpr int kLocalIterations = 4;

// The operations that the sampling loop needs for each model: the sample size, the minimal solver, the
// residuals, and the refinement over inliers.
struct RotationKind {
  static constexpr int kSampleSize = 2;

  static void Solve(const RayPairs& pairs, const std::array<Eigen::Index, 2>& sample,
                    std::vector<Eigen::Matrix3d>* models) {
    Weights weights = Weights::Zero(2);
    RayPairs two;
    two.a.resize(2, 3);
    two.b.resize(2, 3);
    for (int i = 0; i < 2; ++i) {
      two.a.row(i) = pairs.a.row(sample[static_cast<std::size_t>(i)]);
      two.b.row(i) = pairs.b.row(sample[static_cast<std::size_t>(i)]);
      weights[i] = 1;
    }
    models->push_back(FitRotation(two, weights));
  }
  static Eigen::ArrayXd Residuals(const RayPairs& pairs, const Eigen::Matrix3d& model) {
    return RotationResiduals(pairs, model);
  }
  static Eigen::Matrix3d Improve(const RayPairs& pairs, const Weights& weights, const Eigen::Matrix3d&,
                                 double) {
    return FitRotation(pairs, weights);
  }
};

struct HomographyKind {
  static constexpr int kSampleSize = 4;

  static void Solve(const RayPairs& pairs, const std::array<Eigen::Index, 4>& sample,
                    std::vector<Eigen::Matrix3d>* models) {
    std::array<Eigen::Vector3d, 4> a, b;
    for (std::size_t i = 0; i < 4; ++i) {
      a[i] = pairs.RayA(sample[i]);
      b[i] = pairs.RayB(sample[i]);
    }
    if (const auto model = SolveFourPoint(a, b)) models->push_back(*model);
  }
  static Eigen::ArrayXd Residuals(const RayPairs& pairs, const Eigen::Matrix3d& model) {
    return HomographyResiduals(pairs, model);
  }
  static Eigen::Matrix3d Improve(const RayPairs& pairs, const Weights& weights, const Eigen::Matrix3d& model,
                                 double inlier_px) {
    return RefineHomography(pairs, weights, model, inlier_px, kLocalIterations);
  }
};

struct EssentialKind {
  static constexpr int kSampleSize = 5;

  static void Solve(const RayPairs& pairs, const std::array<Eigen::Index, 5>& sample,
                    std::vector<Eigen::Matrix3d>* models) {
    std::array<Eigen::Vector3d, 5> a, b;
    for (std::size_t i = 0; i < 5; ++i) {
      a[i] = pairs.RayA(sample[i]);
      b[i] = pairs.RayB(sample[i]);
    }
    *models = SolveFivePoint(a, b);
  }
  static Eigen::ArrayXd Residuals(const RayPairs& pairs, const Eigen::Matrix3d& model) {
    return EssentialResiduals(pairs, model);
  }
  static Eigen::Matrix3d Improve(const RayPairs& pairs, const Weights& weights, const Eigen::Matrix3d& model,
                                 double inlier_px) {
    // All four poses of an essential matrix have the same residuals, so any of them can be refined.
    return EssentialFromPose(
        RefinePose(pairs, weights, PosesFromEssential(model)[0], inlier_px, kLocalIterations));
  }
};

Consensus Evaluate(const Eigen::Matrix3d& model, Eigen::ArrayXd squared_px, double inlier_px) {
  const double limit = inlier_px * inlier_px;
  Consensus result;
  result.found = true;
  result.model = model;
  // NaN compares false, so such a residual counts as the limit and not as an inlier.
  result.cost = (squared_px < limit).select(squared_px, limit).sum();
  result.inliers = static_cast<int>((squared_px < limit).count());
  result.squared_px = std::move(squared_px);
  return result;
}

template <class Kind>
void OptimizeLocally(const RayPairs& pairs, double inlier_px, Consensus* best) {
  for (int round = 0; round < kLocalRounds; ++round) {
    if (best->inliers < Kind::kSampleSize + 1) return;
    const Weights weights = (best->squared_px < inlier_px * inlier_px).template cast<double>();
    const Eigen::Matrix3d model = Kind::Improve(pairs, weights, best->model, inlier_px);
    Consensus improved = Evaluate(model, Kind::Residuals(pairs, model), inlier_px);
    if (!(improved.cost < best->cost)) return;
    *best = std::move(improved);
  }
}

// The number of samples until one without outliers is among them with this confidence.
int IterationsNeeded(int inliers, Eigen::Index total, int sample_size, double confidence) {
  // Avoids std::pow: an optimizer replaces it for some exponents, which changes the rounding.
  double clean = 1;
  for (int i = 0; i < sample_size; ++i) clean *= static_cast<double>(inliers) / static_cast<double>(total);
  if (clean >= 1) return 1;
  if (clean < 1e-9) return std::numeric_limits<int>::max();
  const double needed = std::log(1 - confidence) / std::log1p(-clean);
  return needed < 1e9 ? static_cast<int>(std::ceil(needed)) : std::numeric_limits<int>::max();
}

template <class Kind>
Consensus FindConsensus(const RayPairs& pairs, const ConsensusOptions& options) {
  Checked(options);
  Consensus best;
  best.cost = std::numeric_limits<double>::infinity();
  if (pairs.size() < Kind::kSampleSize) return best;
  Random random(options.seed);
  std::array<Eigen::Index, Kind::kSampleSize> sample;
  std::vector<Eigen::Matrix3d> models;
  constexpr int kMinIterations = 10;
  const auto iterations_for = [&](int inliers) {
    return std::clamp(IterationsNeeded(inliers, pairs.size(), Kind::kSampleSize, options.confidence),
                      kMinIterations, std::max(options.max_iterations, kMinIterations));
  };
  int needed = iterations_for(options.min_inliers);
  for (int iteration = 0; iteration < needed; ++iteration) {
    for (std::size_t i = 0; i < sample.size(); ++i) {
      do sample[i] = random.Below(static_cast<std::uint32_t>(pairs.size()));
      while (std::find(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(i), sample[i]) !=
             sample.begin() + static_cast<std::ptrdiff_t>(i));
    }
    models.clear();
    Kind::Solve(pairs, sample, &models);
    Consensus best_of_sample;
    best_of_sample.cost = std::numeric_limits<double>::infinity();
    for (const Eigen::Matrix3d& model : models) {
      Consensus candidate = Evaluate(model, Kind::Residuals(pairs, model), options.inlier_px);
      if (candidate.cost < best_of_sample.cost) best_of_sample = std::move(candidate);
    }
    if (!(best_of_sample.cost < best.cost)) continue;
    OptimizeLocally<Kind>(pairs, options.inlier_px, &best_of_sample);
    best = std::move(best_of_sample);
    needed = std::min(needed, iterations_for(best.inliers));
  }
  return best;
}

}  // namespace

std::optional<std::string> ConsensusOptions::Validate() const {
  return OptionCheck()
      .Positive(inlier_px, "inlier threshold of two views")
      .AtLeast(max_iterations, 1, "number of iterations of two views")
      .Ratio(confidence, "confidence of two views")
      .AtLeast(min_inliers, 0, "number of inliers of two views")
      .fault();
}

Consensus FindRotation(const RayPairs& pairs, const ConsensusOptions& options) {
  return FindConsensus<RotationKind>(pairs, options);
}

Consensus FindHomography(const RayPairs& pairs, const ConsensusOptions& options) {
  return FindConsensus<HomographyKind>(pairs, options);
}

Consensus FindEssential(const RayPairs& pairs, const ConsensusOptions& options) {
  return FindConsensus<EssentialKind>(pairs, options);
}

void OfferPose(const RayPairs& pairs, const ConsensusOptions& options, const Rigid3& b_from_a,
               Consensus* best) {
  const Eigen::Matrix3d model = EssentialFromPose(b_from_a);
  Consensus offered = Evaluate(model, EssentialResiduals(pairs, model), options.inlier_px);
  OptimizeLocally<EssentialKind>(pairs, options.inlier_px, &offered);
  if (!best->found || offered.cost < best->cost) *best = std::move(offered);
}

}  // namespace docent::engine
