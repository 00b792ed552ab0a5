// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "engine/base/option_check.h"
#include "engine/base/shared_pool.h"
#include "engine/vision/features.h"
#include "engine/vision/rim_mask.h"

namespace docent::engine {

// Extracts the features of one camera's images, each with the thresholds that the previous image gave, and
// without corners on the black rim of a round image.
// Allocates nothing once its buffers are warm. Used on the camera's thread; the features may be kept and
// dropped on any thread.
class FeatureExtractor {
 public:
  // Throws Error if the options are invalid.
  explicit FeatureExtractor(const FeatureOptions& options) : options_(Checked(options)) {}

  // image: grey (CV_8UC1) or BGR (CV_8UC3).
  std::shared_ptr<const ImageFeatures> Extract(const cv::Mat& image);
  // The image circle as far as the images show it.
  const RimMask& rim() const { return rim_; }

 private:
  FeatureOptions options_;
  SharedPool<ImageFeatures> pool_;
  std::array<int, kPyramidLevels> fast_threshold_{};
  RimMask rim_;
};

}  // namespace docent::engine
