// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/light_estimate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "engine/base/random.h"
#include "engine/dense/surface_samples.h"
#include "engine/map/upright_axes.h"

namespace docent::engine {
namespace {

using Coefficients = Eigen::Matrix<double, 9, 1>;

// The places are divided into so many parts to see whether they agree; a bit of a mask for each.
constexpr int kParts = 8;
constexpr unsigned kAllParts = 0xFF;

// Two surface samples that are close to each other.
struct Pair {
  Coefficients difference;  // Of the spherical harmonics of their normals.
  double log_ratio = 0;     // Of their brightness.
  int part = 0;
};

std::uint64_t CellOf(const Eigen::Vector3d& place, double side) {
  std::uint64_t key = 0;
  for (const double coordinate : place / side)
    key = key * 2'097'143 + static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(coordinate)));
  return key;
}

std::vector<Pair> PairsOf(const std::vector<SurfaceSample>& samples, double side,
                          const LightOptions& options) {
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells;
  std::vector<std::uint64_t> order;  // So that the result does not depend on the hash table.
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    std::vector<std::uint32_t>& cell = cells[CellOf(samples[i].point, side)];
    if (cell.empty()) order.push_back(CellOf(samples[i].point, side));
    cell.push_back(i);
  }
  const double largest_cosine = std::cos(options.min_angle_deg * std::numbers::pi / 180);
  std::vector<Pair> pairs;
  Random random(1);
  for (std::size_t c = 0; c < order.size(); ++c) {
    const std::vector<std::uint32_t>& cell = cells[order[c]];
    if (cell.size() < 2) continue;
    for (std::size_t trial = 0; trial < options.pairs_per_place; ++trial) {
      const auto size = static_cast<std::uint32_t>(cell.size());
      const SurfaceSample &a = samples[cell[random.Below(size)]], &b = samples[cell[random.Below(size)]];
      if (a.normal.dot(b.normal) > largest_cosine) continue;
      pairs.push_back({SphericalHarmonics(a.normal) - SphericalHarmonics(b.normal),
                       std::log(a.brightness / b.brightness), static_cast<int>(c % kParts)});
    }
  }
  return pairs;
}

// The coefficients of the logarithm of the brightness, without the first, that explain the ratios of the
// pairs best, with the pairs of the parts whose bit is set. Logarithms, because their errors do not depend on
// how bright the pair is; with the brightness itself, errors of the ratios would be smallest where no light
// comes to the common normals. Iteratively reweighted least squares with Cauchy's weights.
Coefficients Fit(const std::vector<Pair>& pairs, unsigned parts) {
  // The second order of diffuse light is weaker than the first (Ramamoorthi and Hanrahan, 2001), and noise of
  // the normals shows most in it: a ridge of a hundredth of the pairs halves coefficients that few of them
  // support.
  constexpr double kRidge = 0.01;
  constexpr int kRounds = 12;
  Coefficients fitted = Coefficients::Zero();
  std::vector<double> residuals;
  double scale = 1;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
    Eigen::Matrix<double, 8, 1> right = Eigen::Matrix<double, 8, 1>::Zero();
    residuals.clear();
    for (const Pair& pair : pairs) {
      if ((parts >> pair.part & 1U) == 0) continue;
      const double residual = pair.log_ratio - pair.difference.dot(fitted);
      residuals.push_back(std::abs(residual));
      const double weight = 1 / (1 + residual * residual / (scale * scale));
      normal += weight * pair.difference.tail<8>() * pair.difference.tail<8>().transpose();
      right += weight * pair.log_ratio * pair.difference.tail<8>();
    }
    if (residuals.empty()) return fitted;
    normal.diagonal().tail<5>().array() += kRidge * static_cast<double>(residuals.size());
    normal.diagonal().array() += 1e-6 * static_cast<double>(residuals.size());
    fitted.tail<8>() = normal.ldlt().solve(right);
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    // Half of the robust standard deviation: most pairs that contradict the others are of two materials.
    scale = std::max(1e-3, 0.5 * 1.4826 * *middle);
  }
  return fitted;
}

// Directions that are even on the sphere (a spherical Fibonacci lattice).
Eigen::Vector3d EvenDirection(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

// The brightness whose logarithm has these coefficients, with a mean of 1.
Coefficients FromLogarithm(const Coefficients& logarithm) {
  constexpr int kDirections = 400;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  Coefficients right = Coefficients::Zero();
  for (int i = 0; i < kDirections; ++i) {
    const Coefficients basis = SphericalHarmonics(EvenDirection(i, kDirections));
    normal += basis * basis.transpose();
    right += std::exp(std::clamp(logarithm.dot(basis), -3.0, 3.0)) * basis;
  }
  const Coefficients brightness = normal.ldlt().solve(right);
  return brightness / brightness[0];
}

Eigen::Vector3d FirstOrder(const Coefficients& c) {
  return {c[3], c[1], c[2]};
}

// Whether halves of the parts agree on the main direction. A half differs from the whole by about as much as
// the whole does from the truth, if the errors of the parts are independent.
bool IsCertain(const std::vector<Pair>& pairs, const Eigen::Vector3d& direction, double most_deg) {
  // Parts whose number has one of its three bits set, and the others.
  for (const unsigned half : {0xAAU, 0x55U, 0xCCU, 0x33U, 0xF0U, 0x0FU}) {
    const Eigen::Vector3d other = FirstOrder(FromLogarithm(Fit(pairs, half)));
    const double cosine = other.dot(direction) / (other.norm() * direction.norm());
    if (!(cosine > std::cos(most_deg * std::numbers::pi / 180))) return false;
  }
  return true;
}

// The brightness of white: the brightest surfaces of a room, apart from a few that shine, are white things.
double White(const std::vector<SurfaceSample>& samples, const Coefficients& shape) {
  constexpr double kShining = 0.02;  // The share of samples that may be lamps, windows and reflections.
  constexpr double kPaper = 0.85;    // Of the light, white paper and paint reflect this much.
  // Where the camera saturates on white things, models would have no shape any more: the surfaces of white
  // ones that face the light stay below 1. In the simulated rooms it is at most 0.67.
  constexpr double kMost = 0.75;
  std::vector<double> albedos;
  for (const SurfaceSample& sample : samples)
    albedos.push_back(sample.brightness / std::max(0.1, shape.dot(SphericalHarmonics(sample.normal))));
  const auto white =
      albedos.begin() + static_cast<std::ptrdiff_t>((1 - kShining) * static_cast<double>(albedos.size()));
  std::nth_element(albedos.begin(), white, albedos.end());
  return std::min(kMost, *white / kPaper);
}

// Weakens what depends on the direction until no direction is dark: a room has no side without light.
void KeepPositive(Coefficients* shape) {
  constexpr double kLeast = 0.1;  // Of the mean.
  double darkest = 1;
  constexpr int kDirections = 200;
  for (int i = 0; i < kDirections; ++i)
    darkest = std::min(darkest, shape->dot(SphericalHarmonics(EvenDirection(i, kDirections))));
  if (darkest < kLeast) shape->tail<8>() *= (1 - kLeast) / (1 - darkest);
}

// Of a place of which only the brightness is known.
LightEstimate LightFromAbove(const MapSnapshot& map, const std::vector<SurfaceSample>& samples,
                             double more_from_above) {
  LightEstimate light;
  const UprightAxes axes = UprightAxesOf(map);
  light.to_light = axes.up;
  const Eigen::Vector3d slope = more_from_above * axes.up;
  Coefficients shape = Coefficients::Unit(0);
  shape.segment<3>(1) << slope.y(), slope.z(), slope.x();
  light.brightness = White(samples, shape) * shape;
  return light;
}

}  // namespace

Coefficients SphericalHarmonics(const Eigen::Vector3d& d) {
  Coefficients basis;
  basis << 1, d.y(), d.z(), d.x(), d.x() * d.y(), d.y() * d.z(), 3 * d.z() * d.z() - 1, d.x() * d.z(),
      d.x() * d.x() - d.y() * d.y();
  return basis;
}

double LightEstimate::BrightnessOf(const Eigen::Vector3d& normal) const {
  return std::max(0.0, brightness.dot(SphericalHarmonics(normal)));
}

std::optional<LightEstimate> EstimateLight(const MapSnapshot& map, const SurfaceMesh& mesh,
                                           const LightOptions& options) {
  std::vector<double> depths;
  for (const KeyFrame& keyframe : map.keyframes) depths.push_back(keyframe.mean_depth);
  if (depths.empty() || mesh.empty()) return std::nullopt;
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2),
                   depths.end());
  const double side = options.neighbourhood * depths[depths.size() / 2];
  if (!(side > 0)) return std::nullopt;
  const std::vector<SurfaceSample> samples =
      SampleSurfaces(map, mesh, options.samples, options.max_keyframes, options.max_width_px);
  if (samples.size() < options.min_samples) return std::nullopt;
  const std::vector<Pair> pairs = PairsOf(samples, side, options);
  if (pairs.size() < options.min_pairs) return LightFromAbove(map, samples, options.more_from_above);
  Coefficients shape = FromLogarithm(Fit(pairs, kAllParts));
  const Eigen::Vector3d direction = FirstOrder(shape);
  if (!(direction.norm() > 1e-3) || !IsCertain(pairs, direction, options.max_direction_spread_deg))
    return LightFromAbove(map, samples, options.more_from_above);
  KeepPositive(&shape);
  LightEstimate light;
  light.brightness = White(samples, shape) * shape;
  light.to_light = direction.normalized();
  // A light from one direction makes surfaces brighter by max(0, cosine), whose first order is half of it,
  // and whose mean is a quarter. At most four fifths of the mean come from it, as no room is black beside its
  // lamp.
  const double strength = 2 * FirstOrder(light.brightness).norm();
  light.direct = std::min(strength, 4 * 0.8 * light.brightness[0]);
  return light;
}

}  // namespace docent::engine
