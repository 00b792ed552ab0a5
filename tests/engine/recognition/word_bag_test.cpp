// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/word_bag.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "engine/base/random.h"
#include "engine/vision/features.h"

namespace docent::engine {
namespace {

TEST(WordBag, ListsEachLeafOnceInOrderWithItsCount) {
  const WordBag bag = MakeWordBag({9, 4095, 9, 0, 9});
  ASSERT_EQ(bag.size(), 3u);
  EXPECT_EQ(bag[0], VisualWord(0, 1));
  EXPECT_EQ(bag[1], VisualWord(9, 3));
  EXPECT_EQ(bag[2], VisualWord(4095, 1));
  EXPECT_EQ(bag[1].leaf(), 9u);
  EXPECT_EQ(bag[1].count(), 3);
  EXPECT_TRUE(MakeWordBag(std::vector<std::uint32_t>()).empty());
  EXPECT_EQ(MakeWordBag(std::vector<std::uint32_t>(100, 7)).at(0).count(), VisualWord::kMaxCount);
}

TEST(WordBag, AWordIsStoredInTwoBytes) {
  for (const std::uint32_t leaf : {0u, 1u, 2048u, 4095u}) {
    for (int count = 1; count <= VisualWord::kMaxCount; ++count) {
      const VisualWord word(leaf, count);
      EXPECT_EQ(VisualWord::FromBits(word.bits()), word);
      EXPECT_EQ(word.leaf(), leaf);
      EXPECT_EQ(word.count(), count);
    }
  }
}

// Blobs on a grey background near the image centre, so that none leaves the image when it is rotated.
cv::Mat RotatableBlobs(std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 150; ++i) {
    const double angle = random.Uniform(0, 6.28), radius = 170 * std::sqrt(random.Uniform(0, 1));
    const cv::Point middle(static_cast<int>(320 + radius * std::cos(angle)),
                           static_cast<int>(240 + radius * std::sin(angle)));
    cv::rectangle(image, middle, middle + cv::Point(8 + static_cast<int>(random.Below(25)), 12),
                  cv::Scalar(random.Below(256)), -1);
  }
  return image;
}

// The ratio of the words of `a` that `b` contains too.
double SharedRatio(const WordBag& a, const WordBag& b) {
  double shared = 0, all = 0;
  for (const VisualWord& word : a) {
    all += word.count();
    for (const VisualWord& other : b)
      if (other.leaf() == word.leaf()) shared += std::min(word.count(), other.count());
  }
  return shared / all;
}

TEST(WordBag, IsSimilarForARotatedOrDarkerImageAndNotForAnother) {
  const cv::Mat image = RotatableBlobs(1);
  const WordBag bag = MakeWordBag(*MakeFeatures(image));
  EXPECT_GT(bag.size(), 80u);
  EXPECT_EQ(MakeWordBag(*MakeFeatures(image)), bag);
  const double other = SharedRatio(bag, MakeWordBag(*MakeFeatures(RotatableBlobs(2))));
  cv::Mat rotated, dark;
  cv::rotate(image, rotated, cv::ROTATE_180);
  image.convertTo(dark, CV_8U, 0.5, 5);
  EXPECT_GT(SharedRatio(bag, MakeWordBag(*MakeFeatures(rotated))), 1.5 * other);
  EXPECT_GT(SharedRatio(bag, MakeWordBag(*MakeFeatures(dark))), 2 * other);
}

TEST(WordBag, IsEmptyForAnImageWithoutTexture) {
  EXPECT_TRUE(MakeWordBag(*MakeFeatures(cv::Mat(480, 640, CV_8UC1, cv::Scalar(90)))).empty());
}

}  // namespace
}  // namespace docent::engine
