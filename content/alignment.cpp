// SPDX-License-Identifier: Apache-2.0
#include "content/alignment.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "engine/base/error.h"
#include "engine/base/random.h"

namespace docent::content {
namespace {

// People point with errors of some percent, and less spread than this across a line is not known to be any.
constexpr double kMinSpreadRatio = 0.01;
// Ratio of the extent: residuals up to this are those of pointing, never outliers.
constexpr double kPointingError = 0.02;
constexpr double kMaxMedianResidual = 0.25;  // Ratio of the extent.
constexpr int kMaxTriples = 3000;            // All of up to 27 points; beyond, random ones.
constexpr std::uint64_t kTripleSeed = 1;
constexpr const char* kNoPose =
    "No pose brings the points of the model to those in the map; check that each point of the model is "
    "paired "
    "with its own place.";

using Points = std::vector<Eigen::Vector3d>;

// The two largest standard deviations of points along orthogonal axes.
Eigen::Vector2d SpreadOf(const Points& points) {
  Eigen::Matrix3Xd centred(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) centred.col(static_cast<Eigen::Index>(i)) = points[i];
  centred.colwise() -= centred.rowwise().mean().eval();
  const Eigen::JacobiSVD<Eigen::Matrix3Xd> svd(centred);
  return svd.singularValues().head<2>() / std::sqrt(static_cast<double>(points.size()));
}

double ExtentOf(const Points& points) {
  double extent = 0;
  for (const Eigen::Vector3d& a : points) {
    for (const Eigen::Vector3d& b : points) extent = std::max(extent, (a - b).norm());
  }
  return extent;
}

void RefuseDegenerate(const Points& points, const std::string& which) {
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) throw Error("A point " + which + " is not finite.");
  }
  const Eigen::Vector2d spread = SpreadOf(points);
  if (!(spread[0] > 0)) throw Error("The points " + which + " coincide.");
  if (!(spread[1] > kMinSpreadRatio * spread[0]))
    throw Error("The points " + which + " lie on one line; choose at least one beside it.");
}

// The points of both sides.
struct Pairs {
  Points in_model, in_map;

  std::size_t size() const { return in_map.size(); }
  Pairs Chosen(const std::vector<bool>& chosen) const {
    Pairs pairs;
    for (std::size_t i = 0; i < size(); ++i) {
      if (!chosen[i]) continue;
      pairs.in_model.push_back(in_model[i]);
      pairs.in_map.push_back(in_map[i]);
    }
    return pairs;
  }
  std::vector<double> Residuals(const engine::Sim3& map_from_model) const {
    std::vector<double> residuals;
    for (std::size_t i = 0; i < size(); ++i)
      residuals.push_back((map_from_model * in_model[i] - in_map[i]).norm());
    return residuals;
  }
};

double Quantile(std::vector<double> values, std::size_t rank) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank), values.end());
  return values[rank];
}

// The number of correspondences that must agree, at least.
std::size_t Majority(std::size_t count) {
  return count - (count - 3) / 2;
}

// Calls `take` with triples of indices below `count`: with all if there are few, else with random ones.
template <typename Take>
void ForTriples(std::size_t count, const Take& take) {
  const std::size_t all = count * (count - 1) * (count - 2) / 6;
  if (all <= kMaxTriples) {
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        for (std::size_t c = b + 1; c < count; ++c) take({a, b, c});
      }
    }
    return;
  }
  Random random(kTripleSeed);
  const auto below = static_cast<std::uint32_t>(count);
  for (int trial = 0; trial < kMaxTriples; ++trial) {
    const std::array<std::size_t, 3> triple = {random.Below(below), random.Below(below), random.Below(below)};
    if (triple[0] != triple[1] && triple[1] != triple[2] && triple[2] != triple[0]) take(triple);
  }
}

// The pose of three correspondences that most of the others agree with; empty if all triples are degenerate.
std::optional<engine::Sim3> BestOfTriples(const Pairs& pairs) {
  const std::size_t rank = Majority(pairs.size()) - 1;
  std::optional<engine::Sim3> best;
  double least = std::numeric_limits<double>::infinity();
  ForTriples(pairs.size(), [&](const std::array<std::size_t, 3>& triple) {
    Pairs three;
    for (const std::size_t i : triple) {
      three.in_model.push_back(pairs.in_model[i]);
      three.in_map.push_back(pairs.in_map[i]);
    }
    const auto pose = engine::AlignSim3(three.in_map, three.in_model);
    if (!pose) return;
    const double residual = Quantile(pairs.Residuals(*pose), rank);
    if (!(residual < least)) return;
    least = residual;
    best = pose;
  });
  return best;
}

// Those whose residual is explained by the noise of the others, or by pointing.
std::vector<bool> Agreeing(const std::vector<double>& residuals, double extent) {
  const auto count = static_cast<double>(residuals.size());
  // Consistent with the standard deviation for normal errors, with the correction for small samples of
  // Rousseeuw and Leroy 1987.
  const double sigma = 1.4826 * (1 + 5 / (count - 3)) * Quantile(residuals, Majority(residuals.size()) - 1);
  const double limit = std::max(2.5 * sigma, kPointingError * extent);
  std::vector<bool> agreeing;
  for (const double residual : residuals) agreeing.push_back(residual <= limit);
  return agreeing;
}

}  // namespace

Alignment AlignModel(std::span<const Correspondence> correspondences) {
  if (correspondences.size() < kMinAlignmentPoints)
    throw Error("At least three points of the model with their places in the map are needed.");
  Pairs pairs;
  for (const Correspondence& pair : correspondences) {
    pairs.in_model.push_back(pair.in_model);
    pairs.in_map.push_back(pair.in_map);
  }
  RefuseDegenerate(pairs.in_model, "of the model");
  RefuseDegenerate(pairs.in_map, "in the map");
  const double extent = ExtentOf(pairs.in_map);
  Alignment alignment;
  alignment.inliers.assign(pairs.size(), true);
  std::optional<engine::Sim3> pose;
  if (pairs.size() > 3) {
    pose = BestOfTriples(pairs);
    constexpr int kMaxRounds = 10;  // Until the inliers do not change; usually two.
    for (int round = 0; pose && round < kMaxRounds; ++round) {
      const std::vector<bool> agreeing = Agreeing(pairs.Residuals(*pose), extent);
      if (round > 0 && agreeing == alignment.inliers) break;
      alignment.inliers = agreeing;
      const Pairs inliers = pairs.Chosen(agreeing);
      RefuseDegenerate(inliers.in_model, "of the model that fit together");
      pose = engine::AlignSim3(inliers.in_map, inliers.in_model);
    }
  } else {
    pose = engine::AlignSim3(pairs.in_map, pairs.in_model);
  }
  if (!pose) throw Error(kNoPose);
  alignment.map_from_model = *pose;
  alignment.residuals = pairs.Residuals(*pose);
  if (!(Quantile(alignment.residuals, pairs.size() / 2) <= kMaxMedianResidual * extent)) throw Error(kNoPose);
  return alignment;
}

}  // namespace docent::content
