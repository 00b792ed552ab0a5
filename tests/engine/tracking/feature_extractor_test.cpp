// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/feature_extractor.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::World;

TEST(FeatureExtractor, TreatsAGreyImageInColourAsGrey) {
  const cv::Mat gray = World().Render(*Camera(), CameraAt({0, 0, 0}));
  cv::Mat colour;
  cv::cvtColor(gray, colour, cv::COLOR_GRAY2BGR);
  const auto of_gray = FeatureExtractor({}).Extract(gray), of_colour = FeatureExtractor({}).Extract(colour);
  EXPECT_EQ(cv::norm(of_gray->levels[0], of_colour->levels[0], cv::NORM_INF), 0);
  ASSERT_GT(of_gray->corners[0].size(), 100u);
  EXPECT_EQ(of_gray->corners[0].size(), of_colour->corners[0].size());
}

TEST(FeatureExtractor, StartsFromTheThresholdsOfThePreviousImage) {
  const cv::Mat image = World().Render(*Camera(), CameraAt({0, 0, 0}));
  FeatureOptions options;
  options.wanted_corners = {300, 150, 80, 40};
  FeatureExtractor extractor(options);
  const auto first = extractor.Extract(image), second = extractor.Extract(image);
  const auto excess = [&](const ImageFeatures& features) {
    return std::abs(static_cast<int>(features.corners[0].size()) - 300 / 4);
  };
  EXPECT_NE(first->fast_threshold, second->fast_threshold);
  EXPECT_LT(excess(*second), excess(*first));
}

TEST(FeatureExtractor, LeavesFeaturesThatAreHeldUnchanged) {
  FeatureExtractor extractor({});
  cv::Mat colour;
  cv::cvtColor(World().Render(*Camera(), CameraAt({0, 0, 0})), colour, cv::COLOR_GRAY2BGR);
  const auto held = extractor.Extract(colour);
  const cv::Mat before = held->levels[0].clone();
  colour.setTo(cv::Scalar::all(0));
  for (int i = 0; i < 20; ++i) extractor.Extract(colour);
  EXPECT_EQ(cv::norm(held->levels[0], before, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace docent::engine
