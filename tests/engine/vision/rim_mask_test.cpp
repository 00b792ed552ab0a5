// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/rim_mask.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/vision/features.h"

namespace docent::engine {
namespace {

constexpr int kDiscWidth = 320, kDiscHeight = 240;
constexpr double kDiscRadius = 150;

// Random grey values that change with the seed inside a disc, black with noise outside it.
cv::Mat DiscImage(std::uint64_t seed, double radius, int black = 8) {
  Random random(seed);
  cv::Mat image(kDiscHeight, kDiscWidth, CV_8UC1);
  for (int y = 0; y < kDiscHeight; ++y) {
    for (int x = 0; x < kDiscWidth; ++x) {
      const double distance = std::hypot(x - kDiscWidth / 2.0, y - kDiscHeight / 2.0);
      const double value = distance < radius ? random.Uniform(40, 255) : black + random.Uniform(-3, 3);
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(value);
    }
  }
  return image;
}

TEST(RimMaskOptions, AreRefusedOutOfRange) {
  EXPECT_EQ(RimMaskOptions().Validate(), std::nullopt);
  RimMaskOptions options;
  options.images_per_update = 0;
  EXPECT_EQ(options.Validate(), "The number of images between two updates of a rim must be at least 1.");
  EXPECT_THROW(RimMask{options}, Error);
  options = {};
  options.max_bright_ratio = std::nan("");
  EXPECT_EQ(options.Validate(), "The ratio of bright images of a rim must be from 0 to 1.");
}

double DistanceFromCenter(double x, double y) {
  return std::hypot(x - kDiscWidth / 2.0, y - kDiscHeight / 2.0);
}

RimMask MaskOf(double radius, int images, int black = 8) {
  RimMask mask;
  for (int i = 0; i < images; ++i)
    mask.Add(*MakeFeatures(DiscImage(static_cast<std::uint64_t>(i) + 1, radius, black)));
  return mask;
}

TEST(RimMask, IsFoundForADiscAndNotForAFullImage) {
  EXPECT_TRUE(MaskOf(kDiscRadius, 20).found());
  EXPECT_FALSE(MaskOf(1000, 20).found());
}

TEST(RimMask, IsNotUsedBeforeEnoughImages) {
  EXPECT_FALSE(MaskOf(kDiscRadius, 19).found());
}

TEST(RimMask, IsNotMadeOfWhatIsDarkAfterTheLensWasCovered) {
  RimMask mask;
  const auto covered = MakeFeatures(DiscImage(1, 0));
  for (int i = 0; i < 1000; ++i) mask.Add(*covered);
  EXPECT_FALSE(mask.found());
  // The edges of a scene are dark in three of four images.
  for (int i = 0; i < 200; ++i)
    mask.Add(*MakeFeatures(DiscImage(static_cast<std::uint64_t>(i) + 1, i % 4 == 0 ? 1000 : kDiscRadius)));
  EXPECT_FALSE(mask.found());
}

TEST(RimMask, ABrightSurroundingIsNoRim) {
  EXPECT_FALSE(MaskOf(kDiscRadius, 20, 60).found());
}

TEST(RimMask, RemovesTheCornersAtTheEdgeAndKeepsThoseInside) {
  const RimMask mask = MaskOf(kDiscRadius, 20);
  const auto features = MakeFeatures(DiscImage(99, kDiscRadius));
  ImageFeatures masked = *features;
  mask.RemoveCorners(&masked);
  for (int level = 0; level < kPyramidLevels; ++level) {
    const auto index = static_cast<std::size_t>(level);
    const double scale = 1 << level;
    for (const Corner& corner : masked.corners[index])
      EXPECT_LT(DistanceFromCenter(corner.x * scale, corner.y * scale), kDiscRadius - 3 * scale);
    // Only corners near the edge are removed: one cell of the coarsest level, and the patch with its
    // diagonal.
    const double reach = std::sqrt(2.0) * (8 * 3 + 6 * scale);
    std::size_t well_inside = 0, kept_inside = 0;
    for (const Corner& corner : features->corners[index])
      well_inside += DistanceFromCenter(corner.x * scale, corner.y * scale) < kDiscRadius - reach;
    for (const Corner& corner : masked.corners[index])
      kept_inside += DistanceFromCenter(corner.x * scale, corner.y * scale) < kDiscRadius - reach;
    EXPECT_EQ(kept_inside, well_inside) << "level " << level;
    EXPECT_EQ(masked.row_begin[index].size(), features->row_begin[index].size());
    EXPECT_EQ(static_cast<std::size_t>(masked.row_begin[index].back()), masked.corners[index].size());
    for (std::size_t row = 0; row + 1 < masked.row_begin[index].size(); ++row) {
      for (int i = masked.row_begin[index][row]; i < masked.row_begin[index][row + 1]; ++i)
        EXPECT_EQ(masked.corners[index][static_cast<std::size_t>(i)].y, static_cast<int>(row));
    }
  }
}

TEST(RimMask, SurvivesAFlareButIsWithdrawnWhenLightKeepsFallingOnIt) {
  RimMask mask = MaskOf(kDiscRadius, 39);
  ASSERT_TRUE(mask.found());
  EXPECT_FALSE(mask.IsInside({2, 2}, 0));
  mask.Add(*MakeFeatures(DiscImage(50, 1000)));
  EXPECT_TRUE(mask.found()) << "one image of forty";
  for (int i = 0; i < 20; ++i) mask.Add(*MakeFeatures(DiscImage(static_cast<std::uint64_t>(60 + i), 1000)));
  EXPECT_FALSE(mask.found());
  EXPECT_TRUE(mask.IsInside({2, 2}, 0));
}

TEST(RimMask, IsFoundWhereScatteredLightLiftsTheBlack) {
  EXPECT_TRUE(MaskOf(kDiscRadius, 20, 30).found());
}

TEST(RimMask, AnImageOfAnotherSizeBeginsAnew) {
  RimMask mask = MaskOf(kDiscRadius, 20);
  ASSERT_TRUE(mask.found());
  mask.Add(*MakeFeatures(cv::Mat(480, 640, CV_8UC1, cv::Scalar(100))));
  EXPECT_FALSE(mask.found());
}

}  // namespace
}  // namespace docent::engine
