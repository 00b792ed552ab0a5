// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/fast_corners.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/base/random.h"
#include "tests/engine/vision/noise_image.h"

namespace docent::engine {
namespace {

cv::Mat Blurred(int width, int height, std::uint64_t seed) {
  cv::Mat image;
  cv::GaussianBlur(NoiseImage(width, height, seed), image, {}, 1.2);
  return image;
}

void ExpectAsOpenCv(const cv::Mat& image, int threshold, int border) {
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(image, keypoints, threshold, true, cv::FastFeatureDetector::TYPE_9_16);
  std::vector<cv::Point> expected;
  for (const cv::KeyPoint& keypoint : keypoints) {
    const cv::Point place(keypoint.pt);
    if (place.x >= border && place.y >= border && place.x < image.cols - border &&
        place.y < image.rows - border)
      expected.push_back(place);
  }
  std::vector<Corner> corners;
  std::vector<int> row_begin;
  DetectFastCorners(image, threshold, border, &corners, &row_begin);
  std::vector<cv::Point> found;
  for (const Corner& corner : corners) found.emplace_back(corner.x, corner.y);
  EXPECT_EQ(found, expected) << image.size() << " at " << threshold << " within " << border;
  ASSERT_EQ(row_begin.size(), static_cast<std::size_t>(image.rows) + 1);
  for (int row = 0; row <= image.rows; ++row) {
    EXPECT_EQ(row_begin[static_cast<std::size_t>(row)],
              std::count_if(expected.begin(), expected.end(), [&](const cv::Point& p) { return p.y < row; }));
  }
}

TEST(FastCorners, MatchOpenCv) {
  for (const int threshold : {0, 1, 5, 12, 25, 60, 254, 255}) {
    ExpectAsOpenCv(Blurred(320, 240, 1), threshold, 6);
    ExpectAsOpenCv(NoiseImage(161, 97, 2), threshold, 6);
  }
}

TEST(FastCorners, MatchOpenCvForAnyImageWidth) {
  for (int width = 9; width < 60; ++width) {
    ExpectAsOpenCv(Blurred(width, 31, static_cast<std::uint64_t>(width)), 8, 4);
    ExpectAsOpenCv(Blurred(width, 13, static_cast<std::uint64_t>(width)), 8, 6);
  }
}

TEST(FastCorners, AreFoundInAnImageRegion) {
  const cv::Mat image = Blurred(200, 150, 3);
  ExpectAsOpenCv(image(cv::Rect(13, 7, 101, 90)), 10, 6);
}

TEST(FastCorners, RequireNineContiguousPixelsBeyondTheThreshold) {
  // A corner of nine circle pixels, each brighter than the centre by exactly 20.
  cv::Mat image(40, 40, CV_8UC1, cv::Scalar(100));
  for (const cv::Point& offset :
       {cv::Point(0, -3), {1, -3}, {2, -2}, {3, -1}, {3, 0}, {3, 1}, {2, 2}, {1, 3}, {0, 3}})
    image.at<std::uint8_t>(cv::Point(20, 20) + offset) = 120;
  std::vector<Corner> corners;
  std::vector<int> row_begin;
  const auto finds = [&](int threshold) {
    DetectFastCorners(image, threshold, 6, &corners, &row_begin);
    return std::any_of(corners.begin(), corners.end(),
                       [](const Corner& c) { return c.x == 20 && c.y == 20; });
  };
  EXPECT_TRUE(finds(19));
  EXPECT_FALSE(finds(20));
  image.at<std::uint8_t>(23, 20) = 100;  // eight pixels are not enough
  EXPECT_FALSE(finds(5));
}

TEST(FastCorners, AreEmptyForTooSmallImages) {
  for (const cv::Size size : {cv::Size(12, 40), cv::Size(40, 12), cv::Size(1, 1)}) {
    std::vector<Corner> corners(3);
    std::vector<int> row_begin;
    DetectFastCorners(NoiseImage(size.width, size.height, 4), 5, 6, &corners, &row_begin);
    EXPECT_TRUE(corners.empty());
    EXPECT_EQ(row_begin, std::vector<int>(static_cast<std::size_t>(size.height) + 1, 0));
  }
}

}  // namespace
}  // namespace docent::engine
