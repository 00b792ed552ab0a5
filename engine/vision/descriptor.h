// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "engine/vision/image_pyramid.h"

// What a corner looks like, in 36 bytes that stay nearly the same when the image turns, brightens or gains
// contrast: histograms of gradient directions over 3x3 cells, four directions each, of a 15x15 patch of one
// pyramid level turned so that its dominant gradient points to the right (the PhonySIFT of Wagner, Reitmayr,
// Mulloni, Drummond and Schmalstieg 2010; hybrid-slam §5.4), as square roots of shares. Scale is left to the
// levels: a place is described on several, each good for about a third more or less. Free functions without
// state; any thread; nothing here allocates but the vectors that are handed in or out.
namespace docent::engine {

inline constexpr int kDescriptorSize = 36;
// Length of a descriptor as a vector, up to rounding: its bytes are a unit vector times this.
inline constexpr int kDescriptorLength = 512;
// Pixels of the level that must lie around a place on each side, whichever way its patch is turned.
inline constexpr int kDescriptorBorder = 14;

struct Descriptor {
  std::array<std::uint8_t, kDescriptorSize> values{};  // by cell row, cell column, direction (+x, -x, +y, -y)
  bool operator==(const Descriptor&) const = default;
};

// Squared Euclidean distance: 0 for equal ones, at most 2 kDescriptorLength^2 up to rounding.
int SquaredDistance(const Descriptor& a, const Descriptor& b);

struct OrientedDescriptor {
  Descriptor descriptor;
  float direction_rad = 0;  // of the dominant gradient, towards the brighter side, from x to y
};

// A patch with two strong directions has two descriptors, as nobody can tell which will be the stronger one
// in another image.
inline constexpr int kMaxDirections = 2;
struct Description {
  std::array<OrientedDescriptor, kMaxDirections> of_direction;  // strongest first
  int count = 0;
};

// Describes the patch about a (sub-)pixel of one level (CV_8UC1, smooth at the scale of a pixel as pyramid
// levels are). Empty nearer than kDescriptorBorder to the border, or where there is no more texture than
// sensor noise makes.
std::optional<Description> Describe(const cv::Mat& level_image, const Eigen::Vector2f& pixel_of_level);

// A described place of an image.
struct DescribedPlace {
  OrientedDescriptor oriented;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
  std::uint8_t level = 0;                           // that it was described on
};

// Describes a place, given on level 0, on the levels from first_level to last_level (cut to those there are)
// and appends what could be described.
void DescribePlace(const ImageFeatures& features, const Eigen::Vector2f& pixel, int first_level,
                   int last_level, std::vector<DescribedPlace>* places);

struct CornerDescriptionOptions {
  // The corners with the highest Shi-Tomasi score, thinned so that they cover the image, by level.
  std::array<int, kPyramidLevels> corners = {300, 200, 120, 60};
  float min_score = 20;  // Shi-Tomasi, grey values squared
};
// Describes the best corners of an image, level by level.
std::vector<DescribedPlace> DescribeCorners(const ImageFeatures& features,
                                            const CornerDescriptionOptions& options = {});

}  // namespace docent::engine
