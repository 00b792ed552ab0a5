// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace docent::engine {

// The matching cost of every pixel for every plane of a plane sweep. Planes are contiguous.
struct CostVolume {
  CostVolume(int width_in, int height_in, int planes_in)
      : width(width_in),
        height(height_in),
        planes(planes_in),
        costs(static_cast<std::size_t>(width_in) * static_cast<std::size_t>(height_in) *
              static_cast<std::size_t>(planes_in)) {}

  std::size_t Index(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
           static_cast<std::size_t>(planes);
  }

  int width, height, planes;
  std::vector<std::uint8_t> costs;  // 0 best, kMaxCost worst
  static constexpr int kMaxCost = 48;
};

// Costs of a change of the plane between neighbouring pixels.
struct SmoothnessCosts {
  int small_change = 6;           // By one plane: slanted surfaces.
  int large_change = 60;          // By more, where the image has no edge; depth may change anywhere.
  int large_change_at_edge = 24;  // The same at an edge of the image, where depth changes more often.
  int edge_contrast = 16;         // Difference of neighbouring pixels in grey levels that counts as an edge.
};

// What the optimization says of each pixel.
struct PlaneChoice {
  cv::Mat plane;       // CV_32FC1: the best plane, with a fraction of a plane.
  cv::Mat confidence;  // CV_8UC1: 255 (1 - best / second best cost), the neighbours of the best left out.
};

// Semi-global matching (Hirschmueller 2008): minimizes the matching cost plus the costs of changes along
// eight directions. `image` (CV_8UC1, of the volume's size) says where its edges are. Deterministic; pure.
PlaneChoice OptimizePlanes(const CostVolume& volume, const cv::Mat& image, const SmoothnessCosts& smoothness);

}  // namespace docent::engine
