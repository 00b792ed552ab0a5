// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "tests/ui/ui_testing.h"
#include "ui/signpost_model.h"
#include "ui/text.h"

namespace docent::ui {
namespace {

content::Signpost Sign(const std::string& text) {
  content::Signpost sign;
  sign.text = text;
  return sign;
}

TEST(Signpost, FacesTheReaderAboutItsUpAxisFromEverySide) {
  content::Signpost sign = Sign("Elephants");
  sign.anchor = {0.4, 0.2, 1.5};
  sign.up = Eigen::Vector3d(0.1, -1, 0.2).normalized();
  sign.height_m = 0.3;
  Random random(11);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d eye(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3));
    const engine::Sim3 pose = SignpostPose(sign, eye);
    EXPECT_LT((pose * Eigen::Vector3d::Zero() - sign.anchor).norm(), 1e-12);
    EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitY() - sign.up).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(pose.scale, 0.3);
    // Among all rotations about `up`, the pose has the one whose front faces the reader, so the reader has no
    // sideways coordinate.
    const Eigen::Vector3d eye_in_sign = pose.inverse() * eye;
    EXPECT_NEAR(eye_in_sign.x(), 0, 1e-9 * (1 + eye_in_sign.norm()));
    EXPECT_GT(eye_in_sign.z(), 0);
  }
}

TEST(Signpost, HasAValidPoseWhenTheReaderIsStraightAbove) {
  const content::Signpost sign = Sign("Roof");
  const engine::Sim3 pose = SignpostPose(sign, {0, -2, 0});
  EXPECT_TRUE(pose.rotation.matrix().allFinite());
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitY() - sign.up).norm(), 1e-12);
}

TEST(Signpost, LimitsTheTextureSizeForAnyTextLength) {
  for (const std::string& text : {std::string("Hi"), std::string(200000, 'W'), std::string(3000, '\n'),
                                  std::string("\xff\xc0 no UTF-8"), std::string()}) {
    const auto model = MakeSignpostModel(text, std::string(5000, 'M'));
    EXPECT_LE(model->images[0].width_px, 1024);
    EXPECT_LE(model->images[0].height_px, 1024);
    EXPECT_EQ(model->images[0].rgba.size(), 4u * model->images[0].width_px * model->images[0].height_px);
  }
}

TEST(Signpost, ShowsAStripWhenItLeadsToAMap) {
  const auto plain = MakeSignpostModel("Elephants", ""), pointing = MakeSignpostModel("Elephants", "Bay 7");
  EXPECT_GT(pointing->images[0].height_px, plain->images[0].height_px + 40);
}

TEST(Text, IsAlwaysValidAndBounded) {
  EXPECT_EQ(ReadableText("Süd → 象"), "Süd → 象");
  EXPECT_EQ(ReadableText("a\xff"), "a\uFFFD");
  EXPECT_EQ(ReadableText(std::string("a\tb\x01", 4)), "a b ");
  EXPECT_EQ(ReadableText("äää", 3), "ä\u2026");
  TextStyle style;
  style.max_width_px = 120;
  style.max_height_px = 60;
  bool is_cut = false;
  const cv::Mat image = DrawText(std::string(5000, 'x'), style, &is_cut);
  EXPECT_LE(image.cols, 120);
  EXPECT_LE(image.rows, 60);
  EXPECT_TRUE(is_cut);
  DrawText("short", style, &is_cut);
  EXPECT_FALSE(is_cut);
}

using SignpostImage = OffscreenTest;

TEST_F(SignpostImage, ShowsItsBoardToReadersOnBothSides) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  content::Scene scene;
  content::Entity entity;
  entity.signpost = Sign("Elephants");
  entity.signpost.anchor = {0, 0.3, 2};
  entity.signpost.height_m = 0.4;
  scene.entities.push_back(entity);
  engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
  const cv::Mat front = DrawImage(&renderer, tracked, camera, scene);
  // The same distance on the other side, facing back.
  tracked.camera_from_map = {engine::Rotation3::Exp({0, 3.14159265358979, 0}), {0, 0, 4}};
  const cv::Mat back = DrawImage(&renderer, tracked, camera, scene);
  // Both readers see the text: the same front, not its mirror image or the plain back.
  cv::Mat difference;
  cv::absdiff(front, back, difference);
  EXPECT_GT(cv::mean(front)[2], 1.0);
  EXPECT_LT(cv::mean(difference.colRange(200, 440).rowRange(100, 260))[2], 3.0);
  const Eigen::Vector2d board_middle = *camera.Project(Eigen::Vector3d(0, 0.3 - 0.4 * 1.2, 2));
  cv::Mat letters;
  cv::inRange(front, cv::Scalar(180, 180, 180), cv::Scalar(255, 255, 255), letters);
  const cv::Moments moments = cv::moments(letters, true);
  ASSERT_GT(moments.m00, 100);
  EXPECT_NEAR(moments.m10 / moments.m00, board_middle.x(), 8);
  EXPECT_NEAR(moments.m01 / moments.m00, board_middle.y(), 12);
}

}  // namespace
}  // namespace docent::ui
