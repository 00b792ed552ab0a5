// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "tests/engine/vision/noise_image.h"

namespace docent::engine {
namespace {

// Random rectangles, which give corners of every scale and contrast.
cv::Mat Rectangles(int width, int height, std::uint64_t seed, double contrast = 1) {
  Random random(seed);
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  const int count = width * height / 150;
  for (int i = 0; i < count; ++i) {
    const cv::Point corner(static_cast<int>(random.Below(static_cast<std::uint32_t>(width))),
                           static_cast<int>(random.Below(static_cast<std::uint32_t>(height))));
    const cv::Size size(3 + static_cast<int>(random.Below(30)), 3 + static_cast<int>(random.Below(30)));
    cv::rectangle(image, cv::Rect(corner, size), cv::Scalar(128 + contrast * random.Uniform(-110, 110)),
                  cv::FILLED);
  }
  return image;
}

bool SameFeatures(const ImageFeatures& a, const ImageFeatures& b) {
  for (std::size_t level = 0; level < kPyramidLevels; ++level) {
    if (a.levels[level].size() != b.levels[level].size() ||
        cv::norm(a.levels[level], b.levels[level], cv::NORM_INF) != 0 ||
        a.row_begin[level] != b.row_begin[level] || a.fast_threshold[level] != b.fast_threshold[level] ||
        !std::equal(a.corners[level].begin(), a.corners[level].end(), b.corners[level].begin(),
                    b.corners[level].end(),
                    [](const Corner& p, const Corner& q) { return p.x == q.x && p.y == q.y; })) {
      return false;
    }
  }
  return cv::norm(a.small_blurry.pixels, b.small_blurry.pixels, cv::NORM_INF) == 0;
}

TEST(PyramidCoordinates, RoundTripBetweenLevels) {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector2d pixel(random.Uniform(0, 640), random.Uniform(0, 480));
    for (int level = 0; level < kPyramidLevels; ++level)
      EXPECT_LT((LevelZeroFromLevel(LevelFromLevelZero(pixel, level), level) - pixel).norm(), 1e-9);
  }
  EXPECT_EQ(LevelZeroFromLevel({7, 9}, 0), Eigen::Vector2d(7, 9));
}

// In an image whose grey value is the pixel coordinate, each pixel of a level must show the coordinate that
// it maps to, up to the rounding of each level.
TEST(PyramidCoordinates, MatchTheLevelsOfAnyImageSize) {
  for (const cv::Size size :
       {cv::Size(240, 240), cv::Size(241, 239), cv::Size(251, 255), cv::Size(246, 250)}) {
    cv::Mat columns(size, CV_8UC1), rows(size, CV_8UC1);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        columns.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x);
        rows.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(y);
      }
    }
    const auto by_column = MakeFeatures(columns), by_row = MakeFeatures(rows);
    for (int level = 1; level < kPyramidLevels; ++level) {
      const cv::Mat& x_image = by_column->levels[static_cast<std::size_t>(level)];
      const cv::Mat& y_image = by_row->levels[static_cast<std::size_t>(level)];
      ASSERT_EQ(x_image.size(), cv::Size(size.width >> level, size.height >> level));
      double worst = 0;
      for (int y = 0; y < x_image.rows; ++y) {
        for (int x = 0; x < x_image.cols; ++x) {
          const Eigen::Vector2d place = LevelZeroFromLevel({x, y}, level);
          worst = std::max({worst, std::abs(place.x() - x_image.at<std::uint8_t>(y, x)),
                            std::abs(place.y() - y_image.at<std::uint8_t>(y, x))});
        }
      }
      EXPECT_LE(worst, 0.5 * level + 1e-9) << size << " level " << level;
    }
  }
}

TEST(HalvedImage, IsTheRoundedMeanOfTwoByTwoPixels) {
  for (const cv::Size size : {cv::Size(64, 48), cv::Size(37, 21), cv::Size(2, 2), cv::Size(33, 3)}) {
    const cv::Mat image = NoiseImage(size.width, size.height, 12);
    cv::Mat half;
    HalveImage(image, &half);
    ASSERT_EQ(half.size(), size / 2);
    for (int y = 0; y < half.rows; ++y) {
      for (int x = 0; x < half.cols; ++x) {
        int sum = 0;
        for (const int dy : {0, 1})
          for (const int dx : {0, 1}) sum += image.at<std::uint8_t>(2 * y + dy, 2 * x + dx);
        EXPECT_EQ(half.at<std::uint8_t>(y, x), (sum + 2) / 4) << size << ' ' << x << ' ' << y;
      }
    }
  }
}

TEST(Features, HaveSortedCornersWithARowIndex) {
  const auto features = MakeFeatures(Rectangles(333, 251, 5));
  for (std::size_t level = 0; level < kPyramidLevels; ++level) {
    const cv::Mat& image = features->levels[level];
    const auto& corners = features->corners[level];
    const auto& row_begin = features->row_begin[level];
    EXPECT_GT(corners.size(), 5u) << level;
    EXPECT_TRUE(std::is_sorted(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
      return a.y != b.y ? a.y < b.y : a.x < b.x;
    }));
    ASSERT_EQ(row_begin.size(), static_cast<std::size_t>(image.rows) + 1);
    for (int row = 0; row <= image.rows; ++row) {
      const auto before = std::count_if(corners.begin(), corners.end(),
                                        [row](const Corner& corner) { return corner.y < row; });
      EXPECT_EQ(row_begin[static_cast<std::size_t>(row)], before) << level << ' ' << row;
    }
    for (const Corner& corner : corners) {
      EXPECT_TRUE(corner.x >= 4 && corner.y >= 4 && corner.x < image.cols - 4 && corner.y < image.rows - 4);
    }
  }
}

TEST(Features, DependOnTheImageOnly) {
  const cv::Mat image = Rectangles(320, 240, 1), other = Rectangles(320, 240, 2, 0.2);
  const auto alone = MakeFeatures(image);
  MakeFeatures(other);
  ImageFeatures reused;
  ExtractFeatures(other, {}, {40, 40, 40, 40}, &reused);
  EXPECT_TRUE(SameFeatures(*alone, *MakeFeatures(image)));
  EXPECT_FALSE(SameFeatures(*alone, *MakeFeatures(other)));
}

TEST(Features, DoNotDependOnReusedMemory) {
  const cv::Mat image = Rectangles(320, 240, 1), other = Rectangles(400, 300, 2, 0.5);
  const std::array<int, kPyramidLevels> hint = {12, 14, 16, 18};
  ImageFeatures fresh, used;
  ExtractFeatures(image, {}, hint, &fresh);
  ExtractFeatures(other, {}, hint, &used);
  ExtractFeatures(image, {}, hint, &used);
  EXPECT_TRUE(SameFeatures(fresh, used));
}

TEST(Features, ConvergeToTheWantedCornerCounts) {
  FeatureOptions options;
  options.wanted_corners = {800, 400, 150, 60};
  for (const double contrast : {1.0, 0.4}) {
    const cv::Mat image = Rectangles(640, 480, 7, contrast);
    for (const int start : {options.min_threshold, options.max_threshold}) {
      std::array<int, kPyramidLevels> hint;
      hint.fill(start);
      ImageFeatures features;
      for (int frame = 0; frame < 20; ++frame) {
        ExtractFeatures(image, options, hint, &features);
        hint = features.fast_threshold;
        for (const int threshold : hint) {
          EXPECT_GE(threshold, options.min_threshold);
          EXPECT_LE(threshold, options.max_threshold);
        }
      }
      for (std::size_t level = 0; level < kPyramidLevels; ++level) {
        const double ratio =
            static_cast<double>(features.corners[level].size()) / options.wanted_corners[level];
        if (hint[level] < options.max_threshold) {
          EXPECT_LT(ratio, 1.35) << level << " from " << start;
        }
        if (hint[level] > options.min_threshold) {
          EXPECT_GT(ratio, 0.65) << level << " from " << start;
        }
      }
    }
  }
}

TEST(FeatureOptions, AreRefusedOutOfRange) {
  EXPECT_EQ(FeatureOptions().Validate(), std::nullopt);
  FeatureOptions options;
  options.max_threshold = options.min_threshold - 1;
  EXPECT_EQ(options.Validate(), "The largest threshold of a keypoint must be from 5 to 255.");
  EXPECT_THROW(MakeFeatures(cv::Mat(64, 64, CV_8UC1, cv::Scalar(90)), options), Error);
  options = {};
  options.wanted_corners[2] = -1;
  EXPECT_EQ(options.Validate(), "The number of keypoints of a level must be at least 0.");
}

TEST(Features, AreValidForSmallAndUniformImages) {
  for (const cv::Mat& image : {Rectangles(64, 64, 3), cv::Mat(64, 80, CV_8UC1, cv::Scalar(100))}) {
    const auto features = MakeFeatures(image);
    for (std::size_t level = 0; level < kPyramidLevels; ++level) {
      EXPECT_EQ(features->row_begin[level].size(),
                static_cast<std::size_t>(features->levels[level].rows) + 1);
      EXPECT_EQ(features->row_begin[level].back(), static_cast<int>(features->corners[level].size()));
    }
    EXPECT_FALSE(features->small_blurry.pixels.empty());
  }
}

}  // namespace
}  // namespace docent::engine
