// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/ui/ui_testing.h"
#include "ui/inset.h"

// What is drawn for see-through displays, and of the second camera.
namespace docent::ui {
namespace {

const engine::CameraModel kSmallCamera(engine::LensModel::kRadialTangential,
                                       {320, 240, 250, 250, 159.5, 119.5}, {});

int CountGreen(const cv::Mat& image) {
  int count = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const cv::Vec3b pixel = image.at<cv::Vec3b>(y, x);
      if (pixel[1] > 200 && pixel[0] < 60 && pixel[2] < 60) ++count;
    }
  }
  return count;
}

class SeeThrough : public OffscreenTest {
 protected:
  SeeThrough() { scene_.entities = {Facing(SquareModel(0.4f, {0, 1, 0, 1}), {0, 0, 2})}; }
  content::Scene scene_;
};

TEST_F(SeeThrough, TheContentIsOnBlackSeenFromTheEye) {
  Renderer renderer;
  const cv::Mat noise = NoiseImage(320, 240, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(noise);
  View view;
  view.tracked = &tracked;
  view.camera = &kSmallCamera;
  view.scene = &scene_;
  view.shows_video = false;
  view.overlay.hud = false;
  // The eye is 0.1 to the left of the camera, so that the square is 12.5 pixels further right.
  engine::Rigid3 eye_from_map;
  eye_from_map.translation = {0.1, 0, 0};
  view.seen_from_map = &eye_from_map;
  renderer.Draw(view);
  cv::Mat image;
  renderer.ReadBack(&image);
  EXPECT_NEAR(CountGreen(image), 50 * 50, 150);
  EXPECT_LT((Centroid(image) - Eigen::Vector2d(159.5 + 12.5, 119.5)).norm(), 0.3);
  cv::Mat blue;
  cv::extractChannel(image, blue, 0);
  EXPECT_EQ(cv::countNonZero(blue), 0) << "nothing of the video";
}

TEST_F(SeeThrough, TheContentIsDrawnAtTheSameAnglesAtEveryQuality) {
  Renderer renderer;
  const engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(240, 320, CV_8UC3));
  View view;
  view.tracked = &tracked;
  view.camera = &kSmallCamera;
  view.scene = &scene_;
  view.overlay.hud = false;
  for (const double scale : {2.0, 1.0, 0.5, 1.625}) {
    for (const int samples : {4, 1}) {
      renderer.SetQuality(samples, scale);
      renderer.Draw(view);
      cv::Mat image;
      renderer.ReadBack(&image);
      EXPECT_EQ(image.cols, 320 * scale);
      EXPECT_EQ(image.rows, 240 * scale);
      EXPECT_NEAR(CountGreen(image), 2500 * scale * scale, 220 * scale);
      const Eigen::Vector2d middle(0.5 * (image.cols - 1), 0.5 * (image.rows - 1));
      EXPECT_LT((Centroid(image) - middle).norm(), 0.75)
          << "half a pixel in both directions, without smoothing";
    }
  }
}

TEST_F(SeeThrough, TheSecondCamerasImageHasItsContent) {
  Renderer renderer;
  const engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(240, 320, CV_8UC3));
  const engine::TrackedFrame other = Tracked(cv::Mat::zeros(240, 320, CV_8UC3));
  View view;
  view.tracked = &tracked;
  view.camera = &kSmallCamera;
  view.overlay.hud = false;
  view.overlay.inset = &other;
  view.overlay.inset_camera = &kSmallCamera;
  const auto draw = [&](const content::Scene* inset_scene) {
    view.overlay.inset_scene = inset_scene;
    renderer.Draw(view);
    cv::Mat image;
    renderer.ReadBack(&image);
    const Inset inset = PlaceInset(320, 240, 320, 240);
    return CountGreen(image(cv::Rect(inset.x, inset.y, inset.width, inset.height)).clone());
  };
  EXPECT_EQ(draw(nullptr), 0);
  const double scale = PlaceInset(320, 240, 320, 240).width / 320.0;
  EXPECT_NEAR(draw(&scene_), 2500 * scale * scale, 60);
}

}  // namespace
}  // namespace docent::ui
