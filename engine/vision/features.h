// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

struct FeatureOptions {
  // Target number of corners per level for a 640x480 image; scaled with the image area.
  std::array<int, kPyramidLevels> wanted_corners = {1600, 900, 450, 220};
  int min_threshold = 5;  // grey values; below it FAST responds to sensor noise
  int max_threshold = 60;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Pyramid, FAST corners and thumbnail of a grey image (CV_8UC1, at least 64x64). The threshold of each level
// is adapted from `threshold_hint` (the previous image's thresholds, zeros for none) towards the target
// number. Reuses the memory of *features. The image itself becomes level 0 without a copy.
void ExtractFeatures(const cv::Mat& gray, const FeatureOptions& options,
                     const std::array<int, kPyramidLevels>& threshold_hint, ImageFeatures* features);

// For a stored image: adapts the threshold iteratively from scratch, so that the result depends on the image
// alone. Throws Error if the options are invalid.
std::shared_ptr<const ImageFeatures> MakeFeatures(const cv::Mat& gray, const FeatureOptions& options = {});

// Whether both images are equal in every pixel of the coarsest level. The noise of a camera makes any two of
// its images differ there, so that only an image that was delivered twice is equal to the one before.
bool AreEqual(const ImageFeatures& a, const ImageFeatures& b);

}  // namespace docent::engine
