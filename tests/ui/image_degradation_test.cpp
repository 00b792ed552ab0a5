// SPDX-License-Identifier: Apache-2.0
#include "ui/image_degradation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "engine/vision/features.h"
#include "tests/ui/ui_testing.h"

namespace docent::ui {
namespace {

constexpr int kWidth = 640, kHeight = 480;

// A plain image with noise of this standard deviation, grey levels, the same in all channels.
cv::Mat NoisyImage(double sigma, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(kHeight, kWidth, CV_8UC3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double sum = -6;
      for (int i = 0; i < 12; ++i) sum += random.Uniform();
      image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(120 + sigma * sum));
    }
  }
  return image;
}

// Smooth random texture, wider than an image.
cv::Mat Texture() {
  cv::Mat coarse(kHeight / 8, kWidth / 4, CV_8UC1), texture;
  Random random(4);
  for (int y = 0; y < coarse.rows; ++y) {
    for (int x = 0; x < coarse.cols; ++x)
      coarse.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(40 + random.Below(160));
  }
  cv::resize(coarse, texture, {2 * kWidth, kHeight}, 0, 0, cv::INTER_CUBIC);
  return texture;
}

double DeviationIn(const cv::Mat& image, const cv::Rect& area) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image(area), mean, deviation);
  return deviation[1];
}

// A camera that moves past a texture: the keyframe and the frames see parts of it, the frames blurred.
class MovingCamera {
 public:
  static constexpr int kStep_px = 16;

  MovingCamera() {
    engine::KeyFrame keyframe;
    keyframe.id = 3;
    keyframe.camera = std::make_shared<const engine::CameraModel>(StronglyDistorted());
    keyframe.features = engine::MakeFeatures(texture_(cv::Rect(0, 0, kWidth, kHeight)).clone());
    map_->keyframes.push_back(keyframe);
    for (unsigned i = 0; i < 300; ++i) {
      engine::MapPoint point;
      point.id = i;
      point.source_keyframe = 3;
      point.source_pixel = {30 + 29 * static_cast<float>(i % 20), 30 + 29 * static_cast<float>(i / 20)};
      map_->points.push_back(point);
    }
  }
  // The frame after so many steps, blurred over this part of a step.
  engine::TrackedFrame Frame(int steps, double exposed) const {
    const int length = static_cast<int>(std::lround(exposed * kStep_px));
    cv::Mat blurred = texture_.clone(), bgr;
    if (length > 1) cv::blur(texture_, blurred, {2 * (length / 2) + 1, 1});
    cv::cvtColor(blurred(cv::Rect(steps * kStep_px, 0, kWidth, kHeight)), bgr, cv::COLOR_GRAY2BGR);
    engine::TrackedFrame tracked = Tracked(bgr);
    tracked.frame.time = FromSeconds(1 + steps / 30.0);
    tracked.map = map_;
    tracked.map_key = 1;
    for (const engine::MapPoint& point : map_->points) {
      const Eigen::Vector2f pixel =
          point.source_pixel - Eigen::Vector2f(static_cast<float>(steps * kStep_px), 0);
      if (pixel.x() > 10) tracked.matches.push_back({point.id, pixel, 0, true});
    }
    return tracked;
  }

 private:
  const cv::Mat texture_ = Texture();
  std::shared_ptr<engine::MapSnapshot> map_ = std::make_shared<engine::MapSnapshot>();
};

TEST(ImageDegradation, NoiseIsThatOfTheImage) {
  for (const double sigma : {0.0, 1.0, 3.0, 8.0}) {
    DegradationEstimator estimator;
    const engine::TrackedFrame tracked = Tracked(NoisyImage(sigma, 5));
    EXPECT_NEAR(255 * estimator.Update(&tracked).noise, sigma, 0.2 + 0.1 * sigma);
  }
}

TEST(ImageDegradation, ASharpTextureIsNoNoise) {
  cv::Mat image(kHeight, kWidth, CV_8UC3, cv::Scalar::all(90));
  for (int x = 0; x < kWidth / 2; x += 7) cv::line(image, {x, 0}, {x, kHeight}, cv::Scalar::all(200), 2);
  DegradationEstimator estimator;
  const engine::TrackedFrame tracked = Tracked(image);
  EXPECT_EQ(estimator.Update(&tracked).noise, 0);
}

TEST(ImageDegradation, ExposureAndMotionAreThoseOfTheCamera) {
  const MovingCamera camera;
  for (const double exposed : {0.0, 0.3, 0.6, 0.9}) {
    DegradationEstimator estimator;
    ImageDegradation last;
    for (int step = 0; step < 8; ++step) {
      const engine::TrackedFrame tracked = camera.Frame(step, exposed);
      last = estimator.Update(&tracked);
    }
    EXPECT_NEAR(30 * estimator.exposure_s(), exposed, 0.12);
    const glm::vec2 motion = last.motion * glm::vec3(320, 240, 1);
    EXPECT_NEAR(std::abs(motion.x), exposed * MovingCamera::kStep_px, 2);
    EXPECT_NEAR(motion.y, 0, 0.1);
  }
}

TEST(ImageDegradation, NothingMovesWithoutAPose) {
  const MovingCamera camera;
  DegradationEstimator estimator;
  for (int step = 0; step < 4; ++step) {
    const engine::TrackedFrame tracked = camera.Frame(step, 0.5);
    estimator.Update(&tracked);
  }
  engine::TrackedFrame lost = camera.Frame(4, 0.5);
  lost.state = engine::TrackingState::kLost;
  EXPECT_EQ(estimator.Update(&lost).motion, glm::mat3x2(0.0f));
  EXPECT_EQ(estimator.Update(nullptr).motion, glm::mat3x2(0.0f));
  // The frame after a loss has no predecessor.
  const engine::TrackedFrame again = camera.Frame(5, 0.5);
  EXPECT_EQ(estimator.Update(&again).motion, glm::mat3x2(0.0f));
}

class DegradedContentTest : public OffscreenTest {
 protected:
  cv::Mat Draw(const engine::TrackedFrame& tracked, bool degraded) {
    View view;
    view.tracked = &tracked;
    view.camera = &camera_;
    view.scene = &scene_;
    view.overlay.hud = false;
    view.follows_exposure = false;
    view.follows_degradation = degraded;
    renderer_->Draw(view);
    cv::Mat image;
    renderer_->ReadBack(&image);
    return image;
  }
  void SetUp() override {
    OffscreenTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    renderer_ = std::make_unique<Renderer>();
    scene_.entities.push_back(Facing(SquareModel(0.6f, glm::vec4(0.2f, 0.2f, 0.2f, 1)), {0, 0, 2}));
  }

  const engine::CameraModel camera_ = StronglyDistorted();
  const cv::Rect inside_{290, 212, 60, 60};
  content::Scene scene_;
  std::unique_ptr<Renderer> renderer_;
};

TEST_F(DegradedContentTest, HasTheNoiseOfTheVideoAndAnotherOneInEachImage) {
  const engine::TrackedFrame tracked = Tracked(NoisyImage(6, 9));
  EXPECT_EQ(DeviationIn(Draw(tracked, false), inside_), 0);
  const cv::Mat first = Draw(tracked, true), second = Draw(tracked, true);
  EXPECT_NEAR(DeviationIn(first, inside_), 6, 1);
  EXPECT_NEAR(cv::mean(first(inside_))[1], cv::mean(Draw(tracked, false)(inside_))[1], 0.5);
  cv::Mat difference;
  cv::absdiff(first(inside_), second(inside_), difference);
  EXPECT_GT(cv::mean(difference)[1], 3);
}

TEST_F(DegradedContentTest, IsBlurredAlongTheMotionOfTheCamera) {
  const MovingCamera moving;
  cv::Mat sharp, blurred;
  for (int step = 0; step < 8; ++step) {
    const engine::TrackedFrame tracked = moving.Frame(step, 0.75);
    sharp = Draw(tracked, false);
    blurred = Draw(tracked, true);
  }
  // How much of the square's sharp edge is left in the rows and columns that cross it.
  const auto steepest = [](const cv::Mat& image, bool across) {
    int greatest = 0;
    for (int i = -30; i <= 30; ++i) {
      for (int j = 230; j < 410; ++j) {
        const cv::Vec3b a = across ? image.at<cv::Vec3b>(242 + i, j) : image.at<cv::Vec3b>(j - 78, 319 + i);
        const cv::Vec3b b =
            across ? image.at<cv::Vec3b>(242 + i, j + 1) : image.at<cv::Vec3b>(j - 77, 319 + i);
        greatest = std::max(greatest, std::abs(a[1] - b[1]));
      }
    }
    return greatest;
  };
  EXPECT_LT(steepest(blurred, true), steepest(sharp, true) / 2);
  EXPECT_GT(steepest(blurred, false), steepest(sharp, false) * 2 / 3);
}

}  // namespace
}  // namespace docent::ui
