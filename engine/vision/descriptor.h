// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/vision/image_pyramid.h"

// Keypoint descriptors of 36 bytes that are nearly invariant to rotation, brightness and contrast: histograms
// of gradient directions over 3x3 cells with four directions each, of a 15x15 patch of one pyramid level that
// is rotated so that its dominant gradient points to the right (the PhonySIFT of Wagner, Reitmayr, Mulloni,
// Drummond and Schmalstieg 2010; hybrid-slam §5.4). Values are square roots of ratios. Scale is covered by
// the levels: a keypoint is described on several, each valid for a scale change of about a third. Stateless
// free functions; any thread; only the vectors passed in or out are allocated.
namespace docent::engine {

inline constexpr int kDescriptorSize = 36;
// Norm of a descriptor up to rounding: its bytes are a unit vector times this.
inline constexpr int kDescriptorLength = 512;
// Pixels of the level needed on each side of a keypoint, for any rotation of its patch.
inline constexpr int kDescriptorBorder = 14;

struct Descriptor {
  std::array<std::uint8_t, kDescriptorSize> values{};  // by cell row, cell column, direction (+x, -x, +y, -y)
  bool operator==(const Descriptor&) const = default;
};

// Squared Euclidean distance: 0 for equal descriptors, at most 2 kDescriptorLength^2 up to rounding.
int SquaredDistance(const Descriptor& a, const Descriptor& b);

struct OrientedDescriptor {
  Descriptor descriptor;
  float direction_rad = 0;  // of the dominant gradient, towards the brighter side, from x to y
};

// A patch with two strong directions has two descriptors, because either may be the stronger one in another
// image.
inline constexpr int kMaxDirections = 2;
struct Description {
  std::array<OrientedDescriptor, kMaxDirections> of_direction;  // strongest first
  int count = 0;
};

// Describes the patch around a (sub-)pixel of one level (CV_8UC1, smoothed like a pyramid level). Empty
// nearer than kDescriptorBorder to the image border, or if the texture does not exceed sensor noise.
std::optional<Description> Describe(const cv::Mat& level_image, const Eigen::Vector2f& pixel_of_level);

// A keypoint with its descriptor.
struct DescribedKeypoint {
  OrientedDescriptor oriented;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
  std::uint8_t level = 0;                           // of the description
};

// Describes a level-0 pixel on the levels from first_level to last_level (limited to existing ones) and
// appends the descriptors that could be computed.
void DescribeKeypoint(const ImageFeatures& features, const Eigen::Vector2f& pixel, int first_level,
                      int last_level, std::vector<DescribedKeypoint>* places);

struct CornerDescriptionOptions {
  // Number of corners per level: those with the highest Shi-Tomasi score, spread over the image.
  std::array<int, kPyramidLevels> corners = {300, 200, 120, 60};
  float min_score = 20;  // Shi-Tomasi score, grey values squared

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};
// Describes the best corners of an image, level by level.
std::vector<DescribedKeypoint> DescribeCorners(const ImageFeatures& features,
                                               const CornerDescriptionOptions& options = {});

}  // namespace docent::engine
