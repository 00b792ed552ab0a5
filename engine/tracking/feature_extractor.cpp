// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/feature_extractor.h"

#include <opencv2/imgproc.hpp>

namespace docent::engine {

std::shared_ptr<const ImageFeatures> FeatureExtractor::Extract(const cv::Mat& image) {
  std::shared_ptr<ImageFeatures> features = pool_.Take();
  cv::Mat gray;
  if (image.channels() == 1) {
    gray = image;
  } else {
    gray = features->levels[0];
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  }
  ExtractFeatures(gray, options_, fast_threshold_, features.get());
  fast_threshold_ = features->fast_threshold;
  rim_.Add(*features);
  rim_.RemoveCorners(features.get());
  return features;
}

}  // namespace docent::engine
