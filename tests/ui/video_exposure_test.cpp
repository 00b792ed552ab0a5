// SPDX-License-Identifier: Apache-2.0
#include "ui/video_exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "engine/dense/surface_samples.h"
#include "engine/vision/features.h"
#include "tests/ui/ui_testing.h"

namespace docent::ui {
namespace {

// An image of smooth random patches between two grey levels.
cv::Mat Patches(int low, int high) {
  cv::Mat coarse(12, 16, CV_8UC1), image;
  Random random(11);
  for (int y = 0; y < coarse.rows; ++y) {
    for (int x = 0; x < coarse.cols; ++x)
      coarse.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(
          low + static_cast<int>(random.Below(static_cast<std::uint32_t>(high - low))));
  }
  cv::resize(coarse, image, {640, 480}, 0, 0, cv::INTER_NEAREST);
  return image;
}

// The image that a camera takes with other gains of blue, green and red light.
cv::Mat WithGains(const cv::Mat& gray, const cv::Vec3d& gains) {
  cv::Mat image(gray.size(), CV_8UC3);
  for (int y = 0; y < gray.rows; ++y) {
    for (int x = 0; x < gray.cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double linear = gains[c] * engine::LinearFromLevel(gray.at<std::uint8_t>(y, x));
        const double encoded =
            linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
        image.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<std::uint8_t>(255 * encoded);
      }
    }
  }
  return image;
}

// A map of one keyframe whose points a frame of the same view sees.
class VideoExposureTest : public ::testing::Test {
 protected:
  VideoExposureTest() {
    engine::KeyFrame keyframe;
    keyframe.id = 3;
    keyframe.camera = std::make_shared<const engine::CameraModel>(StronglyDistorted());
    keyframe.features = engine::MakeFeatures(gray_);
    map_->keyframes.push_back(keyframe);
    for (unsigned i = 0; i < 150; ++i) {
      engine::MapPoint point;
      point.id = i;
      point.source_keyframe = 3;
      point.source_pixel = {20 + 40 * static_cast<float>(i % 15), 20 + 40 * static_cast<float>(i / 15)};
      map_->points.push_back(point);
    }
  }
  engine::TrackedFrame FrameWith(const cv::Vec3d& gains) const {
    engine::TrackedFrame tracked = Tracked(WithGains(gray_, gains));
    tracked.map = map_;
    tracked.map_key = 1;
    for (const engine::MapPoint& point : map_->points)
      tracked.matches.push_back({point.id, point.source_pixel, 0, true});
    return tracked;
  }

  const cv::Mat gray_ = Patches(40, 160);
  std::shared_ptr<engine::MapSnapshot> map_ = std::make_shared<engine::MapSnapshot>();
  VideoExposure exposure_;
};

TEST_F(VideoExposureTest, IsTheRatioOfTheImageToTheKeyFrames) {
  for (const double gain : {1.0, 0.5, 1.7, 1.0}) {
    const engine::TrackedFrame tracked = FrameWith(cv::Vec3d::all(gain));
    const glm::vec3 exposure = exposure_.Update(&tracked);  // A jump, which is followed at once.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(exposure[c], gain, 0.03 * gain);
  }
}

TEST_F(VideoExposureTest, FollowsHalfOfTheColourOfTheBrightestParts) {
  const engine::TrackedFrame tracked = FrameWith({0.8, 1.0, 1.25});  // Warm: more red, less blue.
  const glm::vec3 exposure = exposure_.Update(&tracked);
  EXPECT_NEAR(exposure.r / exposure.b, std::sqrt(1.25 / 0.8), 0.05);
  EXPECT_GT(exposure.r, exposure.g);
  EXPECT_GT(exposure.g, exposure.b);
}

TEST_F(VideoExposureTest, StaysWhereNothingIsKnown) {
  engine::TrackedFrame lost = FrameWith(cv::Vec3d::all(0.5));
  lost.matches.resize(5);
  EXPECT_EQ(exposure_.Update(&lost), glm::vec3(1.0f));
  EXPECT_EQ(exposure_.Update(nullptr), glm::vec3(1.0f));
  const engine::TrackedFrame tracked = FrameWith(cv::Vec3d::all(0.5));
  const glm::vec3 known = exposure_.Update(&tracked);
  EXPECT_NEAR(known.g, 0.5, 0.02);
  EXPECT_EQ(exposure_.Update(&lost), known);
}

TEST_F(VideoExposureTest, SmoothsSmallChanges) {
  const engine::TrackedFrame first = FrameWith(cv::Vec3d::all(1)), second = FrameWith(cv::Vec3d::all(1.1));
  const float before = exposure_.Update(&first).g;
  const float after = exposure_.Update(&second).g;
  EXPECT_GT(after, before + 0.01f);
  EXPECT_LT(after, before + 0.06f);
  for (int i = 0; i < 20; ++i) exposure_.Update(&second);
  EXPECT_NEAR(exposure_.Update(&second).g, 1.1, 0.03);
}

// The keyframe has been taken without shading; the points are elsewhere in the images.
TEST_F(VideoExposureTest, FollowsTheShadingOfTheLens) {
  constexpr double kCorner = -0.7;  // Logarithm of the light that is left in the corners.
  const cv::Mat plain(gray_.size(), CV_8UC1, cv::Scalar(110));
  map_->keyframes[0].features = engine::MakeFeatures(plain);
  cv::Mat shaded(plain.size(), CV_8UC3);
  const double middle_x = 0.5 * (plain.cols - 1), middle_y = 0.5 * (plain.rows - 1);
  for (int y = 0; y < plain.rows; ++y) {
    for (int x = 0; x < plain.cols; ++x) {
      const double radius2 = ((x - middle_x) * (x - middle_x) + (y - middle_y) * (y - middle_y)) /
                             (middle_x * middle_x + middle_y * middle_y);
      const double linear = std::exp(kCorner * radius2) * engine::LinearFromLevel(110);
      shaded.at<cv::Vec3b>(y, x) =
          cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(255 * (1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
    }
  }
  engine::TrackedFrame tracked = FrameWith(cv::Vec3d::all(1));
  tracked.frame.image = shaded;
  for (int frame = 0; frame < 60; ++frame) {
    for (std::size_t i = 0; i < tracked.matches.size(); ++i) {
      const Eigen::Vector2f source = map_->points[i].source_pixel;
      tracked.matches[i].pixel = source + Eigen::Vector2f(static_cast<float>(frame), 0);
    }
    exposure_.Update(&tracked);
  }
  EXPECT_NEAR(exposure_.shading(), kCorner, 0.15);
  EXPECT_GT(exposure_.shading_reference(), 0.1);
  EXPECT_LT(exposure_.shading_reference(), 0.6);
}

TEST_F(VideoExposureTest, ImagesWithoutShadingHaveNone) {
  const engine::TrackedFrame tracked = FrameWith(cv::Vec3d::all(0.8));
  for (int i = 0; i < 30; ++i) exposure_.Update(&tracked);
  EXPECT_NEAR(exposure_.shading(), 0, 0.02);
}

}  // namespace
}  // namespace docent::ui
