// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/small_blurry_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <vector>

#include "engine/base/random.h"
#include "tests/engine/vision/noise_image.h"
#include "tests/engine/vision/painted_sphere.h"

namespace docent::engine {
namespace {

TEST(MakeThumbnail, BlursLikeOpenCv) {
  for (const double sigma_px : {0.8, 2.5}) {
    for (const cv::Size size : {cv::Size(640, 480), cv::Size(333, 251), cv::Size(64, 64), cv::Size(90, 3)}) {
      const cv::Mat image = NoiseImage(size.width, size.height, 4);
      const SmallBlurryImage made = MakeSmallBlurryImage(image, sigma_px);
      cv::Mat expected;
      image(cv::Rect({0, 0}, made.pixels.size() * made.scale)).convertTo(expected, CV_32F);
      cv::resize(expected, expected, made.pixels.size(), 0, 0, cv::INTER_AREA);
      cv::GaussianBlur(expected, expected, {}, sigma_px);
      expected -= cv::mean(expected);
      EXPECT_LT(cv::norm(expected, made.pixels, cv::NORM_INF), 0.02) << size << ' ' << sigma_px;
    }
  }
}

TEST(MakeThumbnail, ReusesMemoryUnlessAnotherOwnerHoldsIt) {
  const cv::Mat one = NoiseImage(320, 240, 1), other = NoiseImage(320, 240, 2);
  SmallBlurryImage thumbnail;
  MakeSmallBlurryImage(one, kThumbnailBlurPx, &thumbnail);
  const void* memory = thumbnail.pixels.data;
  MakeSmallBlurryImage(other, kThumbnailBlurPx, &thumbnail);
  EXPECT_EQ(thumbnail.pixels.data, memory);
  EXPECT_EQ(Difference(thumbnail, MakeSmallBlurryImage(other)), 0);
  const SmallBlurryImage held = thumbnail;
  MakeSmallBlurryImage(one, kThumbnailBlurPx, &thumbnail);
  EXPECT_EQ(Difference(held, MakeSmallBlurryImage(other)), 0);
  EXPECT_EQ(Difference(thumbnail, MakeSmallBlurryImage(one)), 0);
}

TEST(SmallBlurryImage, IsAtMostEightyPixelsWide) {
  const struct {
    int width, height, scale, small_width, small_height;
  } cases[] = {{640, 480, 8, 80, 60}, {752, 480, 10, 75, 48},   {80, 60, 1, 80, 60},
               {81, 60, 2, 40, 30},   {1920, 1080, 24, 80, 45}, {1, 1, 1, 1, 1}};
  for (const auto& c : cases) {
    const SmallBlurryImage small = MakeSmallBlurryImage(cv::Mat(c.height, c.width, CV_8UC1, cv::Scalar(7)));
    EXPECT_EQ(small.pixels.type(), CV_32FC1);
    EXPECT_EQ(small.scale, c.scale) << c.width;
    EXPECT_EQ(small.pixels.size(), cv::Size(c.small_width, c.small_height));
  }
}

TEST(SmallBlurryImage, HoldsBlockMeansMinusTheirMean) {
  cv::Mat image(16, 160, CV_8UC1);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>((x * 37 + y * 101) % 256);
  const SmallBlurryImage small = MakeSmallBlurryImage(image, 0);
  ASSERT_EQ(small.scale, 2);
  cv::Mat expected(8, 80, CV_64FC1);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 80; ++x) expected.at<double>(y, x) = cv::mean(image(cv::Rect(2 * x, 2 * y, 2, 2)))[0];
  const double mean = cv::mean(expected)[0];
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 80; ++x)
      EXPECT_NEAR(small.pixels.at<float>(y, x), expected.at<double>(y, x) - mean, 1e-3);
  EXPECT_NEAR(cv::mean(small.pixels)[0], 0, 1e-3);
}

TEST(SmallBlurryImage, DoesNotOverflowForLargeBrightImages) {
  cv::Mat image(600, 24000, CV_8UC1, cv::Scalar(255));
  image.colRange(0, 12000).setTo(253);
  const SmallBlurryImage small = MakeSmallBlurryImage(image, 0);
  ASSERT_EQ(small.scale, 300);
  EXPECT_NEAR(small.pixels.at<float>(0, 0), -1, 1e-3);
  EXPECT_NEAR(small.pixels.at<float>(1, 79), 1, 1e-3);
}

TEST(SmallBlurryImage, DifferenceIsTheMeanSquareOrInfiniteForDifferentSizes) {
  SmallBlurryImage a, b;
  a.pixels = cv::Mat(6, 7, CV_32FC1, cv::Scalar(2));
  b.pixels = cv::Mat(6, 7, CV_32FC1, cv::Scalar(2));
  EXPECT_EQ(Difference(a, b), 0);
  b.pixels.at<float>(3, 4) = 2 + 21;
  EXPECT_NEAR(Difference(a, b), 21.0 * 21 / 42, 1e-6);
  b.pixels = cv::Mat(7, 6, CV_32FC1, cv::Scalar(2));
  EXPECT_EQ(Difference(a, b), std::numeric_limits<double>::infinity());
  EXPECT_EQ(Difference({}, {}), std::numeric_limits<double>::infinity());
}

TEST(SmallBlurryImage, DiffersLessForTheSamePlaceThanForAnother) {
  const PaintedSphere sphere(3);
  const auto make = [&](const Rotation3& rotation) {
    return MakeSmallBlurryImage(sphere.Render(Pinhole(), rotation, 1, 0, 4));
  };
  const auto here = make({});
  const auto nearby = make(Rotation3::Exp({0.01, 0.02, 0}));
  const auto elsewhere = make(Rotation3::Exp({0, 1.5, 0}));
  EXPECT_LT(5 * Difference(here, nearby), Difference(here, elsewhere));
}

}  // namespace
}  // namespace docent::engine
