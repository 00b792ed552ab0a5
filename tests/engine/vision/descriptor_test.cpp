// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/descriptor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "engine/base/random.h"
#include "engine/vision/features.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

// Smooth random blobs, defined at every real coordinate, so that a rotated or scaled image can be computed
// exactly.
class Blobs {
 public:
  explicit Blobs(std::uint64_t seed, double reach = 400) {
    Random random(seed);
    const int count = static_cast<int>(reach * reach / 30);
    for (int i = 0; i < count; ++i) {
      blobs_.push_back({random.Uniform(-reach / 2, reach / 2), random.Uniform(-reach / 2, reach / 2),
                        random.Uniform(2.0, 4.5), random.Uniform(-70, 70)});
    }
    // Only nearby blobs are summed: each cell of the grid lists the blobs that reach it.
    cells_ = static_cast<int>(reach / kCell) + 1;
    origin_ = -reach / 2;
    grid_.resize(static_cast<std::size_t>(cells_ * cells_));
    for (const Blob& blob : blobs_) {
      for (int row = CellOf(blob.y - 4 * blob.size); row <= CellOf(blob.y + 4 * blob.size); ++row)
        for (int column = CellOf(blob.x - 4 * blob.size); column <= CellOf(blob.x + 4 * blob.size); ++column)
          grid_[static_cast<std::size_t>(row * cells_ + column)].push_back(blob);
    }
  }
  double operator()(double x, double y) const {
    double grey = 128;
    for (const Blob& blob : grid_[static_cast<std::size_t>(CellOf(y) * cells_ + CellOf(x))]) {
      const double dx = x - blob.x, dy = y - blob.y;
      grey += blob.height * std::exp(-(dx * dx + dy * dy) / (2 * blob.size * blob.size));
    }
    return grey;
  }

 private:
  static constexpr double kCell = 20;
  struct Blob {
    double x, y, size, height;
  };
  int CellOf(double value) const {
    return std::clamp(static_cast<int>((value - origin_) / kCell), 0, cells_ - 1);
  }
  std::vector<Blob> blobs_;
  std::vector<std::vector<Blob>> grid_;
  int cells_ = 0;
  double origin_ = 0;
};

// An image of 41x41 pixels around a place, which is at pixel (20, 20).
cv::Mat Around(const std::function<double(double, double)>& grey, const Eigen::Vector2d& place,
               double rotation_rad = 0, double scale = 1) {
  cv::Mat image(41, 41, CV_8UC1);
  const double c = scale * std::cos(rotation_rad), s = scale * std::sin(rotation_rad);
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 41; ++x)
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
          grey(place.x() + c * (x - 20) - s * (y - 20), place.y() + s * (x - 20) + c * (y - 20)));
  return image;
}

const Eigen::Vector2f kPlaceInImage(20, 20);

std::vector<Eigen::Vector2d> Places(int count) {
  Random random(11);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < count; ++i) places.push_back({random.Uniform(-150, 150), random.Uniform(-150, 150)});
  return places;
}

// The distance of the nearest pair of descriptors of two places, as matching uses it.
int NearestPairDistance(const Description& a, const Description& b) {
  int min_distance = 4 * kDescriptorLength * kDescriptorLength;
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      min_distance =
          std::min(min_distance, SquaredDistance(a.of_direction[static_cast<std::size_t>(i)].descriptor,
                                                 b.of_direction[static_cast<std::size_t>(j)].descriptor));
  return min_distance;
}

// The ratio of places whose changed image has its nearest neighbour, among all places, in the place itself.
double RecognitionRatio(const std::function<cv::Mat(const Eigen::Vector2d&)>& changed) {
  const Blobs blobs(5);
  std::vector<Description> known, seen;
  for (const Eigen::Vector2d& place : Places(150)) {
    const auto before = Describe(Around(blobs, place), kPlaceInImage);
    const auto after = Describe(changed(place), kPlaceInImage);
    EXPECT_TRUE(before && after);
    if (!before || !after) return 0;
    known.push_back(*before);
    seen.push_back(*after);
  }
  int right = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < known.size(); ++j)
      if (NearestPairDistance(seen[i], known[j]) < NearestPairDistance(seen[i], known[best])) best = j;
    right += best == i;
  }
  return static_cast<double>(right) / static_cast<double>(seen.size());
}

TEST(Descriptor, IsInvariantToRotation) {
  const Blobs blobs(5);
  for (const double rotation_deg : {10.0, 45.0, 90.0, 133.0, 180.0, -77.0}) {
    EXPECT_GT(RecognitionRatio(
                  [&](const Eigen::Vector2d& place) { return Around(blobs, place, Radians(rotation_deg)); }),
              0.95)
        << rotation_deg;
  }
}

TEST(Descriptor, IsInvariantToGainAndOffset) {
  const Blobs blobs(5);
  for (const auto& [gain, offset] : {std::pair{0.5, 0.0}, {0.6, 80.0}, {0.4, 100.0}, {0.8, -20.0}}) {
    EXPECT_GT(RecognitionRatio([&, gain = gain, offset = offset](const Eigen::Vector2d& place) {
                return Around([&](double x, double y) { return gain * blobs(x, y) + offset; }, place);
              }),
              0.97)
        << gain << ' ' << offset;
  }
}

TEST(Descriptor, ToleratesScaleChangesOfAThird) {
  const Blobs blobs(5);
  for (const double scale : {0.75, 0.85, 1.2, 1.33}) {
    EXPECT_GT(
        RecognitionRatio([&](const Eigen::Vector2d& place) { return Around(blobs, place, 0.4, scale); }), 0.9)
        << scale;
  }
}

TEST(Descriptor, ToleratesNoiseAndSubpixelShifts) {
  const Blobs blobs(5);
  Random random(2);
  EXPECT_GT(RecognitionRatio([&](const Eigen::Vector2d& place) {
              const Eigen::Vector2d off(random.Uniform(-0.8, 0.8), random.Uniform(-0.8, 0.8));
              return Around([&](double x, double y) { return blobs(x, y) + random.Uniform(-8, 8); },
                            place + off, random.Uniform(0, 6.28));
            }),
            0.93);
}

TEST(Descriptor, IsUnchangedByABrightnessOffset) {
  const Blobs blobs(6);
  for (const Eigen::Vector2d& place : Places(30)) {
    const cv::Mat image = Around([&](double x, double y) { return 0.3 * blobs(x, y) + 40; }, place);
    const cv::Mat brighter = image + cv::Scalar(60);
    const auto a = Describe(image, kPlaceInImage), b = Describe(brighter, kPlaceInImage);
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->count, b->count);
    EXPECT_LT(NearestPairDistance(*a, *b), 20);
  }
}

TEST(Descriptor, DirectionRotatesWithTheImage) {
  const Blobs blobs(7);
  int agree = 0, all = 0;
  for (const Eigen::Vector2d& place : Places(60)) {
    const double turn = 0.9;
    const auto before = Describe(Around(blobs, place), kPlaceInImage);
    const auto after = Describe(Around(blobs, place, turn), kPlaceInImage);
    ASSERT_TRUE(before && after);
    if (before->count != 1 || after->count != 1) continue;
    ++all;
    // Rotating the camera by `turn` rotates the image content the other way.
    const double change = after->of_direction[0].direction_rad - before->of_direction[0].direction_rad + turn;
    agree += std::abs(std::remainder(change, 2 * std::numbers::pi)) < 0.1;
  }
  EXPECT_GT(all, 20);
  EXPECT_GE(agree, all * 9 / 10);
}

TEST(Descriptor, DirectionFollowsTheGradientOfAnEdge) {
  // The image is brighter to the lower right.
  const cv::Mat edge = Around([](double x, double y) { return 128 + 80 * std::tanh((x + y) / 4); }, {0, 0});
  const auto description = Describe(edge, kPlaceInImage);
  ASSERT_TRUE(description);
  EXPECT_EQ(description->count, 1);
  EXPECT_NEAR(description->of_direction[0].direction_rad, std::numbers::pi / 4, 0.03);
  // Relative to its own direction, all gradients point along +x.
  for (std::size_t i = 0; i < kDescriptorSize; ++i) {
    if (i % 4 != 0) {
      EXPECT_LE(description->of_direction[0].descriptor.values[i], 30) << i;
    }
  }
}

TEST(Descriptor, IsNormalizedToAConstantLength) {
  const Blobs blobs(8);
  for (const Eigen::Vector2d& place : Places(50)) {
    const auto description = Describe(Around(blobs, place), kPlaceInImage);
    ASSERT_TRUE(description);
    const int squared = SquaredDistance(description->of_direction[0].descriptor, {});
    EXPECT_NEAR(std::sqrt(squared), kDescriptorLength, 8);
  }
}

TEST(Descriptor, RejectsPixelsNearTheBorder) {
  const cv::Mat image = Around(Blobs(9), {0, 0});
  EXPECT_TRUE(Describe(image, {14, 14}));
  EXPECT_TRUE(Describe(image, {26, 26}));
  for (const Eigen::Vector2f& pixel :
       {Eigen::Vector2f(13.9f, 20), Eigen::Vector2f(20, 13.9f), Eigen::Vector2f(26.1f, 20),
        Eigen::Vector2f(20, 26.1f), Eigen::Vector2f(-5, 20), Eigen::Vector2f(1e9f, 20),
        Eigen::Vector2f(std::nanf(""), 20)}) {
    EXPECT_FALSE(Describe(image, pixel)) << pixel.transpose();
  }
}

TEST(Descriptor, RejectsUniformAndNoisyPatches) {
  EXPECT_FALSE(Describe(Around([](double, double) { return 90; }, {0, 0}), kPlaceInImage));
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    // The noise has a standard deviation of 1.4 grey values, like that of a webcam.
    const cv::Mat noise = Around([&](double, double) { return 90.5 + random.Uniform(-2.4, 2.4); }, {0, 0});
    EXPECT_FALSE(Describe(noise, kPlaceInImage));
  }
}

TEST(DescriptorDistance, EqualsItsDefinition) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    Descriptor a, b;
    int expected = 0;
    for (std::size_t i = 0; i < kDescriptorSize; ++i) {
      a.values[i] = static_cast<std::uint8_t>(random.Below(256));
      b.values[i] = static_cast<std::uint8_t>(random.Below(256));
      expected += (a.values[i] - b.values[i]) * (a.values[i] - b.values[i]);
    }
    EXPECT_EQ(SquaredDistance(a, b), expected);
    EXPECT_EQ(SquaredDistance(b, a), expected);
    EXPECT_EQ(SquaredDistance(a, a), 0);
  }
  Descriptor zeros, full;
  full.values.fill(255);
  EXPECT_EQ(SquaredDistance(zeros, full), 36 * 255 * 255);
}

TEST(DescribeCornersTest, FindsTheSamePlacesFromTwoViews) {
  const auto world = testing_world::RenderedWorld::SingleWall(2, 4);
  const auto camera = testing_world::PinholeCamera(480, 360);
  const Rigid3 pose_a = testing_world::CameraAt({0, 0, 0});
  const Rigid3 pose_b = testing_world::CameraAt({0.3, 0.1, 0.2}, {0, -8, 35});
  const auto a = DescribeCorners(*MakeFeatures(world.Render(*camera, pose_a, 1.5)));
  const auto b = DescribeCorners(*MakeFeatures(world.Render(*camera, pose_b, 1.5, 2)));
  ASSERT_GT(a.size(), 300u);
  ASSERT_GT(b.size(), 300u);
  int accepted = 0, right = 0;
  for (const DescribedKeypoint& seen : b) {
    int best = std::numeric_limits<int>::max(), second = best;
    const DescribedKeypoint* nearest = nullptr;
    for (const DescribedKeypoint& place : a) {
      const int distance = SquaredDistance(seen.oriented.descriptor, place.oriented.descriptor);
      if (nearest && (place.pixel - nearest->pixel).norm() < 6) {
        best = std::min(best, distance);
      } else if (distance < best) {
        second = best;
        best = distance;
        nearest = &place;
      } else {
        second = std::min(second, distance);
      }
    }
    if (best > 0.5 * second) continue;
    ++accepted;
    const auto hit = world.AtPixel(*camera, pose_b, seen.pixel.cast<double>());
    ASSERT_TRUE(hit);
    const auto expected = camera->Project(pose_a * hit->point);
    right += expected && (expected->cast<float>() - nearest->pixel).norm() <
                             static_cast<float>(2 << std::max(nearest->level, seen.level));
  }
  EXPECT_GT(accepted, 100);
  EXPECT_GT(right, accepted * 4 / 5) << accepted;
}

TEST(DescribePlaceTest, UsesTheLevelsWhereThePatchFits) {
  const auto features = MakeFeatures(testing_world::RenderedWorld::SingleWall(2, 4).Render(
      *testing_world::PinholeCamera(320, 240), testing_world::CameraAt({0, 0, 0})));
  std::vector<DescribedKeypoint> places;
  DescribeKeypoint(*features, {160, 120}, -3, 9, &places);
  std::array<int, kPyramidLevels> count{};
  for (const DescribedKeypoint& place : places) {
    EXPECT_EQ(place.pixel, Eigen::Vector2f(160, 120));
    ++count[place.level];
  }
  // Level 3 has 40x30 pixels, and only its centre is far enough from the border.
  for (std::size_t level = 0; level < kPyramidLevels; ++level) EXPECT_GE(count[level], 1) << level;
  places.clear();
  DescribeKeypoint(*features, {40, 120}, 0, 3, &places);
  for (const DescribedKeypoint& place : places) EXPECT_LE(place.level, 1);
  EXPECT_FALSE(places.empty());
}

}  // namespace
}  // namespace docent::engine
