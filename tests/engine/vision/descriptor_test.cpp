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
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

// Smooth random blobs, known at every real place, so that a turned or scaled image follows from
// mathematics.
class Blobs {
 public:
  explicit Blobs(std::uint64_t seed, double reach = 400) {
    Random random(seed);
    const int count = static_cast<int>(reach * reach / 30);
    for (int i = 0; i < count; ++i) {
      blobs_.push_back({random.Uniform(-reach / 2, reach / 2), random.Uniform(-reach / 2, reach / 2),
                        random.Uniform(2.0, 4.5), random.Uniform(-70, 70)});
    }
    // Only near blobs are summed up: each cell of the grid knows those that reach it.
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

// An image of 41x41 pixels about a place: its middle is pixel (20, 20).
cv::Mat Around(const std::function<double(double, double)>& grey, const Eigen::Vector2d& place,
               double turn_rad = 0, double scale = 1) {
  cv::Mat image(41, 41, CV_8UC1);
  const double c = scale * std::cos(turn_rad), s = scale * std::sin(turn_rad);
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 41; ++x)
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
          grey(place.x() + c * (x - 20) - s * (y - 20), place.y() + s * (x - 20) + c * (y - 20)));
  return image;
}

const Eigen::Vector2f kMiddle(20, 20);

std::vector<Eigen::Vector2d> Places(int count) {
  Random random(11);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < count; ++i) places.push_back({random.Uniform(-150, 150), random.Uniform(-150, 150)});
  return places;
}

// Of the descriptors of two images of the same place: the nearest pair counts, as it does in matching.
int Difference(const Description& a, const Description& b) {
  int least = 4 * kDescriptorLength * kDescriptorLength;
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      least = std::min(least, SquaredDistance(a.of_direction[static_cast<std::size_t>(i)].descriptor,
                                              b.of_direction[static_cast<std::size_t>(j)].descriptor));
  return least;
}

// Counts how often the changed image of a place is nearest, among all places, to the place itself.
double PartRecognised(const std::function<cv::Mat(const Eigen::Vector2d&)>& changed) {
  const Blobs blobs(5);
  std::vector<Description> known, seen;
  for (const Eigen::Vector2d& place : Places(150)) {
    const auto before = Describe(Around(blobs, place), kMiddle);
    const auto after = Describe(changed(place), kMiddle);
    EXPECT_TRUE(before && after);
    if (!before || !after) return 0;
    known.push_back(*before);
    seen.push_back(*after);
  }
  int right = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < known.size(); ++j)
      if (Difference(seen[i], known[j]) < Difference(seen[i], known[best])) best = j;
    right += best == i;
  }
  return static_cast<double>(right) / static_cast<double>(seen.size());
}

TEST(Descriptor, RecognisesPlacesWhateverTheImageIsTurnedBy) {
  const Blobs blobs(5);
  for (const double turn_deg : {10.0, 45.0, 90.0, 133.0, 180.0, -77.0}) {
    EXPECT_GT(PartRecognised([&](const Eigen::Vector2d& place) {
                return Around(blobs, place, turn_deg * std::numbers::pi / 180);
              }),
              0.95)
        << turn_deg;
  }
}

TEST(Descriptor, RecognisesPlacesInOtherLight) {
  const Blobs blobs(5);
  for (const auto& [gain, offset] : {std::pair{0.5, 0.0}, {0.6, 80.0}, {0.4, 100.0}, {0.8, -20.0}}) {
    EXPECT_GT(PartRecognised([&, gain = gain, offset = offset](const Eigen::Vector2d& place) {
                return Around([&](double x, double y) { return gain * blobs(x, y) + offset; }, place);
              }),
              0.97)
        << gain << ' ' << offset;
  }
}

TEST(Descriptor, RecognisesPlacesAThirdNearerOrFurther) {
  const Blobs blobs(5);
  for (const double scale : {0.75, 0.85, 1.2, 1.33}) {
    EXPECT_GT(PartRecognised([&](const Eigen::Vector2d& place) { return Around(blobs, place, 0.4, scale); }),
              0.9)
        << scale;
  }
}

TEST(Descriptor, RecognisesPlacesThroughNoiseAndAPixelOff) {
  const Blobs blobs(5);
  Random random(2);
  EXPECT_GT(PartRecognised([&](const Eigen::Vector2d& place) {
              const Eigen::Vector2d off(random.Uniform(-0.8, 0.8), random.Uniform(-0.8, 0.8));
              return Around([&](double x, double y) { return blobs(x, y) + random.Uniform(-8, 8); },
                            place + off, random.Uniform(0, 6.28));
            }),
            0.93);
}

TEST(Descriptor, KeepsTheSameBytesUnderAnOffsetOfBrightness) {
  const Blobs blobs(6);
  for (const Eigen::Vector2d& place : Places(30)) {
    const cv::Mat image = Around([&](double x, double y) { return 0.3 * blobs(x, y) + 40; }, place);
    const cv::Mat brighter = image + cv::Scalar(60);
    const auto a = Describe(image, kMiddle), b = Describe(brighter, kMiddle);
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->count, b->count);
    EXPECT_LT(Difference(*a, *b), 20);
  }
}

TEST(Descriptor, TurnsItsDirectionWithTheImage) {
  const Blobs blobs(7);
  int agree = 0, all = 0;
  for (const Eigen::Vector2d& place : Places(60)) {
    const double turn = 0.9;
    const auto before = Describe(Around(blobs, place), kMiddle);
    const auto after = Describe(Around(blobs, place, turn), kMiddle);
    ASSERT_TRUE(before && after);
    if (before->count != 1 || after->count != 1) continue;
    ++all;
    // Looking with a camera turned by `turn` turns what it sees the other way.
    const double change = after->of_direction[0].direction_rad - before->of_direction[0].direction_rad + turn;
    agree += std::abs(std::remainder(change, 2 * std::numbers::pi)) < 0.1;
  }
  EXPECT_GT(all, 20);
  EXPECT_GE(agree, all * 9 / 10);
}

TEST(Descriptor, PointsAlongAnEdgesGradient) {
  // Brighter to the lower right.
  const cv::Mat edge = Around([](double x, double y) { return 128 + 80 * std::tanh((x + y) / 4); }, {0, 0});
  const auto description = Describe(edge, kMiddle);
  ASSERT_TRUE(description);
  EXPECT_EQ(description->count, 1);
  EXPECT_NEAR(description->of_direction[0].direction_rad, std::numbers::pi / 4, 0.03);
  // Seen along its own direction all gradients are +x.
  for (std::size_t i = 0; i < kDescriptorSize; ++i) {
    if (i % 4 != 0) {
      EXPECT_LE(description->of_direction[0].descriptor.values[i], 30) << i;
    }
  }
}

TEST(Descriptor, HasTheSameLengthEverywhere) {
  const Blobs blobs(8);
  for (const Eigen::Vector2d& place : Places(50)) {
    const auto description = Describe(Around(blobs, place), kMiddle);
    ASSERT_TRUE(description);
    const int squared = SquaredDistance(description->of_direction[0].descriptor, {});
    EXPECT_NEAR(std::sqrt(squared), kDescriptorLength, 8);
  }
}

TEST(Descriptor, RefusesPlacesNearTheBorder) {
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

TEST(Descriptor, RefusesFlatAndMerelyNoisyPatches) {
  EXPECT_FALSE(Describe(Around([](double, double) { return 90; }, {0, 0}), kMiddle));
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    // Deviation 1.4 grey values, as a webcam's.
    const cv::Mat noise = Around([&](double, double) { return 90.5 + random.Uniform(-2.4, 2.4); }, {0, 0});
    EXPECT_FALSE(Describe(noise, kMiddle));
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

TEST(DescribingCorners, FindsTheSamePlacesFromTwoViews) {
  const auto world = testing_world::RenderedWorld::SingleWall(2, 4);
  const auto camera = testing_world::PinholeCamera(480, 360);
  const Rigid3 pose_a = testing_world::CameraAt({0, 0, 0});
  const Rigid3 pose_b = testing_world::CameraAt({0.3, 0.1, 0.2}, {0, -8, 35});
  const auto a = DescribeCorners(*MakeFeatures(world.Render(*camera, pose_a, 1.5)));
  const auto b = DescribeCorners(*MakeFeatures(world.Render(*camera, pose_b, 1.5, 2)));
  ASSERT_GT(a.size(), 300u);
  ASSERT_GT(b.size(), 300u);
  int accepted = 0, right = 0;
  for (const DescribedPlace& seen : b) {
    int best = std::numeric_limits<int>::max(), second = best;
    const DescribedPlace* nearest = nullptr;
    for (const DescribedPlace& place : a) {
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

TEST(DescribingAPlace, TakesTheLevelsWhereItFits) {
  const auto features = MakeFeatures(testing_world::RenderedWorld::SingleWall(2, 4).Render(
      *testing_world::PinholeCamera(320, 240), testing_world::CameraAt({0, 0, 0})));
  std::vector<DescribedPlace> places;
  DescribePlace(*features, {160, 120}, -3, 9, &places);
  std::array<int, kPyramidLevels> count{};
  for (const DescribedPlace& place : places) {
    EXPECT_EQ(place.pixel, Eigen::Vector2f(160, 120));
    ++count[place.level];
  }
  // 40x30 pixels are left of level 3: the middle alone is far enough from its border.
  for (std::size_t level = 0; level < kPyramidLevels; ++level) EXPECT_GE(count[level], 1) << level;
  places.clear();
  DescribePlace(*features, {40, 120}, 0, 3, &places);
  for (const DescribedPlace& place : places) EXPECT_LE(place.level, 1);
  EXPECT_FALSE(places.empty());
}

}  // namespace
}  // namespace docent::engine
