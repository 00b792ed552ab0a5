// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/pixel_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/base/random.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::World;

class PixelDistance : public ::testing::Test {
 protected:
  std::optional<double> Measure(const Eigen::Vector2d& pixel) const {
    return MeasureDistance(*map_, image_, *Camera(), pose_, pixel);
  }
  std::optional<double> TrueDistance(const Eigen::Vector2d& pixel) const {
    const auto hit = World().AtPixel(*Camera(), pose_, pixel);
    if (!hit) return std::nullopt;
    return (hit->point - pose_.OriginInSource()).norm();
  }

  const Rigid3 pose_ = CameraAt({0.1, 0.05, 0}, {2, -1, 0});
  const std::shared_ptr<const MapSnapshot> map_ =
      testing_world::TrueMap(World(), Camera(),
                             {CameraAt({0, 0, 0}), CameraAt({0.4, 0, 0}, {0, -5, 0}),
                              CameraAt({-0.3, 0.05, 0}, {0, 5, 2}), CameraAt({0.05, 0.3, 0.1}, {5, 0, 0})})
          .Snapshot();
  cv::Mat image_ = World().Render(*Camera(), pose_, 2, 7);
};

TEST_F(PixelDistance, IsCorrectAtNearlyAllPixelsWhereItIsMeasured) {
  Random random(5);
  int pixels = 0, told = 0, right = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d pixel(random.Uniform(0, Camera()->width_px() - 1),
                                random.Uniform(0, Camera()->height_px() - 1));
    const auto truth = TrueDistance(pixel);
    if (!truth) continue;
    ++pixels;
    const auto measured = Measure(pixel);
    if (!measured) continue;
    ++told;
    right += std::abs(*measured / *truth - 1) < 0.03;
  }
  RecordProperty("pixels", pixels);
  RecordProperty("told", told);
  RecordProperty("right", right);
  EXPECT_GE(told, 0.6 * pixels);
  EXPECT_GE(right, 0.93 * told);
}

TEST_F(PixelDistance, DoesNotDependOnExposureOrColour) {
  const Eigen::Vector2d pixel(Camera()->width_px() * 0.5, Camera()->height_px() * 0.5);
  const auto before = Measure(pixel);
  ASSERT_TRUE(before.has_value());
  cv::Mat darker;
  image_.convertTo(darker, CV_8UC1, 0.7, 10);
  cv::cvtColor(darker, image_, cv::COLOR_GRAY2BGR);
  const auto after = Measure(pixel);
  ASSERT_TRUE(after.has_value());
  EXPECT_NEAR(*after, *before, 0.01 * *before);
}

TEST_F(PixelDistance, IsNotMeasuredWithoutTextureImagesOrMap) {
  const Eigen::Vector2d middle(Camera()->width_px() * 0.5, Camera()->height_px() * 0.5);
  EXPECT_FALSE(Measure({2, 2}).has_value()) << "the patch leaves the image";
  EXPECT_FALSE(Measure({-50, 1e6}).has_value());
  EXPECT_FALSE(MeasureDistance(MapSnapshot(), image_, *Camera(), pose_, middle).has_value());
  image_ = cv::Mat();
  EXPECT_FALSE(Measure(middle).has_value());
  image_ = cv::Mat(Camera()->height_px(), Camera()->width_px(), CV_8UC1, cv::Scalar(90));
  EXPECT_FALSE(Measure(middle).has_value()) << "a plain image";
}

}  // namespace
}  // namespace docent::engine
