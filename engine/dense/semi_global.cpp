// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/semi_global.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

namespace docent::engine {
namespace {

constexpr std::uint16_t kOutOfRange = 0x3FFF;  // More than any cost of a path, and its double still fits.

struct Step {
  int dx, dy;
};
constexpr std::array<Step, 8> kDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};

// The costs of the paths that end at one pixel, with one element before and after that is out of range.
class PathCosts {
 public:
  explicit PathCosts(int planes) : costs_(static_cast<std::size_t>(planes) + 2, kOutOfRange) {}
  std::uint16_t* data() { return costs_.data() + 1; }
  const std::uint16_t* data() const { return costs_.data() + 1; }
  std::uint16_t least = 0;

 private:
  std::vector<std::uint16_t> costs_;
};

// Continues the paths from the pixel before, and adds the costs to `sums`.
void ExtendPaths(const PathCosts& before, const std::uint8_t* __restrict costs, int planes, int small_change,
                 int large_change, PathCosts* now, std::uint16_t* __restrict sums) {
  const std::uint16_t* __restrict const from = before.data();
  std::uint16_t* __restrict const to = now->data();
  const auto step = static_cast<std::uint16_t>(small_change);
  const auto jump = static_cast<std::uint16_t>(before.least + large_change);
  const std::uint16_t base = before.least;
  std::uint16_t least = kOutOfRange;
  for (int k = 0; k < planes; ++k) {
    const auto below = static_cast<std::uint16_t>(from[k - 1] + step);
    const auto above = static_cast<std::uint16_t>(from[k + 1] + step);
    const std::uint16_t best = std::min(std::min(from[k], jump), std::min(below, above));
    const auto cost = static_cast<std::uint16_t>(costs[k] + best - base);
    to[k] = cost;
    sums[k] = static_cast<std::uint16_t>(sums[k] + cost);
    least = std::min(least, cost);
  }
  now->least = least;
}

void BeginPaths(const std::uint8_t* costs, int planes, PathCosts* now, std::uint16_t* __restrict sums) {
  std::uint16_t least = kOutOfRange;
  for (int k = 0; k < planes; ++k) {
    now->data()[k] = costs[k];
    sums[k] = static_cast<std::uint16_t>(sums[k] + costs[k]);
    least = std::min<std::uint16_t>(least, costs[k]);
  }
  now->least = least;
}

// Adds the costs of all paths in one direction, row by row.
void AddDirection(const CostVolume& volume, const cv::Mat& image, const SmoothnessCosts& smoothness,
                  const Step& step, std::vector<std::uint16_t>* sums) {
  const int width = volume.width, height = volume.height;
  const bool downwards = step.dy > 0 || (step.dy == 0 && step.dx > 0);
  const bool rightwards = step.dx > 0 || (step.dx == 0 && downwards);
  std::vector<PathCosts> before(static_cast<std::size_t>(width), PathCosts(volume.planes));
  std::vector<PathCosts> now = before;
  for (int row = 0; row < height; ++row) {
    const int y = downwards ? row : height - 1 - row;
    for (int column = 0; column < width; ++column) {
      const int x = rightwards ? column : width - 1 - column;
      const int from_x = x - step.dx, from_y = y - step.dy;
      const std::size_t index = volume.Index(x, y);
      PathCosts* const path = &now[static_cast<std::size_t>(x)];
      if (from_x < 0 || from_y < 0 || from_x >= width || from_y >= height) {
        BeginPaths(&volume.costs[index], volume.planes, path, &(*sums)[index]);
        continue;
      }
      const int contrast = std::abs(image.at<std::uint8_t>(y, x) - image.at<std::uint8_t>(from_y, from_x));
      const int large =
          contrast >= smoothness.edge_contrast ? smoothness.large_change_at_edge : smoothness.large_change;
      const std::vector<PathCosts>& source = step.dy == 0 ? now : before;
      ExtendPaths(source[static_cast<std::size_t>(from_x)], &volume.costs[index], volume.planes,
                  smoothness.small_change, large, path, &(*sums)[index]);
    }
    std::swap(before, now);
  }
}

// The best plane of a pixel from the sums of its path costs.
std::pair<float, std::uint8_t> BestPlane(const std::uint16_t* sums, int planes) {
  const int best = static_cast<int>(std::min_element(sums, sums + planes) - sums);
  int second = std::numeric_limits<int>::max();
  for (int k = 0; k < planes; ++k) {
    if (std::abs(k - best) > 2) second = std::min<int>(second, sums[k]);
  }
  float fraction = 0;
  if (best > 0 && best + 1 < planes) {
    // The two lines of equal slope through the three lowest costs, which suits costs that grow linearly.
    const float before = static_cast<float>(sums[best - 1]) - static_cast<float>(sums[best]);
    const float after = static_cast<float>(sums[best + 1]) - static_cast<float>(sums[best]);
    const float larger = std::max(before, after);
    if (larger > 0) fraction = 0.5F * (before - after) / larger;
  }
  const double ratio = second > 0 ? static_cast<double>(sums[best]) / second : 1;
  const bool at_end = best == 0 || best + 1 == planes;  // The true plane may lie outside the range.
  const double confidence = at_end ? 0 : 255 * (1 - ratio);
  return {static_cast<float>(best) + fraction, static_cast<std::uint8_t>(std::clamp(confidence, 0.0, 255.0))};
}

}  // namespace

PlaneChoice OptimizePlanes(const CostVolume& volume, const cv::Mat& image,
                           const SmoothnessCosts& smoothness) {
  std::vector<std::uint16_t> sums(volume.costs.size(), 0);
  for (const Step& step : kDirections) AddDirection(volume, image, smoothness, step, &sums);
  PlaneChoice choice;
  choice.plane.create(volume.height, volume.width, CV_32FC1);
  choice.confidence.create(volume.height, volume.width, CV_8UC1);
  for (int y = 0; y < volume.height; ++y) {
    for (int x = 0; x < volume.width; ++x) {
      const auto [plane, confidence] = BestPlane(&sums[volume.Index(x, y)], volume.planes);
      choice.plane.at<float>(y, x) = plane;
      choice.confidence.at<std::uint8_t>(y, x) = confidence;
    }
  }
  return choice;
}

}  // namespace docent::engine
