// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tests/ui/ui_testing.h"
#include "ui/entity_shapes.h"
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
  sign.height = 0.3;
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

// The height of a capital letter over that of the board, from the rows of the board that have letters.
double LetterRatio(const content::Image& board) {
  int height = 0, letter = board.height_px;
  for (int y = 0; y < board.height_px; ++y) {
    bool has_letters = false;
    for (int x = 0; x < board.width_px; ++x)
      has_letters = has_letters || board.rgba[4u * static_cast<std::size_t>(y * board.width_px + x)] > 150;
    if (has_letters) {
      ++height;
    } else if (height > 0) {
      letter = std::min(letter, std::exchange(height, 0));
    }
  }
  return static_cast<double>(letter) / board.height_px;
}

// However long the text is, it spans 0.4 degrees from twelve heights of the board away: from three metres, of
// a board of 25 centimetres.
TEST(Signpost, HasLettersThatAreReadFromTwelveHeightsAway) {
  for (const int words : {1, 3, 10, 40, 400}) {
    std::string text;
    for (int i = 0; i < words; ++i) text += "HHHHH ";
    const auto model = MakeSignpostModel(text, "");
    const double angle_deg = std::atan(LetterRatio(model->images[0]) / 12) * 180 / std::numbers::pi;
    EXPECT_GE(angle_deg, 0.4) << words;
  }
}

// A signpost somewhere with any direction, and a camera that sees its arrow from three to six of its heights
// away.
struct SignInView {
  content::Signpost sign = Sign(" ");
  engine::Rigid3 camera_from_map;

  explicit SignInView(Random* random) {
    const auto vector = [&] {
      return Eigen::Vector3d(random->Uniform(-1, 1), random->Uniform(-1, 1), random->Uniform(-1, 1));
    };
    sign.anchor = 5 * vector();
    sign.up = (Eigen::Vector3d(0, -1, 0) + 0.2 * vector()).normalized();
    sign.height = random->Uniform(0.1, 1);
    sign.direction = vector().normalized();
    camera_from_map.rotation = engine::Rotation3::Exp(vector());
    const Eigen::Vector3d middle = SignpostArrowPose(sign).translation;
    const Eigen::Vector3d seen_at(random->Uniform(-0.4, 0.4), random->Uniform(-0.3, 0.3), 1);
    camera_from_map.translation =
        random->Uniform(3, 6) * sign.height * seen_at - camera_from_map.rotation * middle;
  }
  // How the arrow must be seen: from its middle to a point a little further in the direction, in pixels.
  Eigen::Vector2d TrueDirection(const engine::CameraModel& camera) const {
    const Eigen::Vector3d middle = camera_from_map * SignpostArrowPose(sign).translation;
    const Eigen::Vector3d step = camera_from_map.rotation * (1e-3 * sign.height * *sign.direction);
    return (*camera.Project(middle + step) - *camera.Project(middle)) / 1e-3;
  }
};

double AngleTo_deg(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b))) * 180 / std::numbers::pi;
}

TEST(SignpostArrow, PointsFromTailToTipInTheDirectionFromManyPoses) {
  Random random(3);
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 319.5, 239.5},
                                   {});
  float tail = 0, tip = 0;
  for (const content::Primitive& part : SignpostArrowModel()->meshes[0].primitives) {
    for (const content::Vertex& vertex : part.vertices) {
      tail = std::min(tail, vertex.position.z);
      tip = std::max(tip, vertex.position.z);
    }
  }
  EXPECT_FLOAT_EQ(tip, -tail);
  for (int i = 0; i < 500; ++i) {
    const SignInView view(&random);
    const engine::Sim3 pose = SignpostArrowPose(view.sign);
    EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() - *view.sign.direction).norm(), 1e-12);
    const Eigen::Vector3d first = view.camera_from_map * (pose * Eigen::Vector3d(0, 0, tail)),
                          last = view.camera_from_map * (pose * Eigen::Vector3d(0, 0, tip));
    const Eigen::Vector2d drawn = *camera.Project(last) - *camera.Project(first);
    if (drawn.norm() < 1) continue;  // Along the ray.
    EXPECT_LT(AngleTo_deg(drawn, view.TrueDirection(camera)), 0.1);
  }
}

TEST(SignpostArrow, HasAValidPoseInEveryDirectionAlsoStraightUp) {
  content::Signpost sign = Sign("Roof");
  for (const Eigen::Vector3d& direction :
       {sign.up, Eigen::Vector3d(-sign.up), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(-1, 0, 0)}) {
    sign.direction = direction;
    const Eigen::Matrix3d axes = SignpostArrowPose(sign).rotation.matrix();
    EXPECT_LT((axes * axes.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_LT((axes.col(2) - direction).norm(), 1e-12);
    EXPECT_GE(axes.col(1).dot(sign.up), -1e-12) << "its upper side is up";
  }
}

TEST(SignpostArrow, StandsAboveTheBoardAndTouchesItNowhere) {
  content::Signpost sign = Sign("Roof");
  sign.height = 0.5;
  for (const double angle : {0.0, 0.5, 1.5, 3.1}) {
    sign.direction = Eigen::Vector3d(0, std::cos(angle), std::sin(angle));
    const engine::Sim3 pose = SignpostArrowPose(sign);
    for (const content::Primitive& part : SignpostArrowModel()->meshes[0].primitives) {
      for (const content::Vertex& vertex : part.vertices) {
        const Eigen::Vector3d point =
            pose * Eigen::Vector3d(vertex.position.x, vertex.position.y, vertex.position.z);
        EXPECT_GT((point - sign.anchor).dot(sign.up), 1.7 * sign.height);
      }
    }
  }
}

TEST(SignpostArrow, IsDrawnOnlyWhereTheDirectionIsKnown) {
  content::Entity entity;
  entity.signpost = Sign("Elephants");
  entity.signpost.to_map = "Bay 7";
  EXPECT_EQ(EntityShapes::ArrowOf(entity).model, nullptr);
  entity.signpost.direction = Eigen::Vector3d(0, 0, 1);
  EXPECT_EQ(EntityShapes::ArrowOf(entity).model, SignpostArrowModel());
  entity.kind = content::Entity::Kind::kLabel;
  EXPECT_EQ(EntityShapes::ArrowOf(entity).model, nullptr);
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
  entity.signpost.height = 0.4;
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

// The middle of the pixels of the arrow's head, which alone is orange; empty if it is hardly seen.
std::optional<Eigen::Vector2d> HeadIn(const cv::Mat& image) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const cv::Vec3b& color = image.at<cv::Vec3b>(y, x);
      if (color[2] < 60 || color[2] < 2.5 * color[0]) continue;
      sum += Eigen::Vector2d(x, y);
      ++count;
    }
  }
  if (count < 30) return std::nullopt;
  return sum / count;
}

TEST_F(SignpostImage, ShowsItsArrowInTheDirectionFromManyPoses) {
  Renderer renderer;
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, {320, 240, 250, 250, 159.5, 119.5},
                                   {});
  Random random(23);
  engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(240, 320, CV_8UC3));
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    const SignInView view(&random);
    // Where the arrow is seen lengthwise, its direction in the image says little, and from below, or far from
    // above, the board or the back of the arrow hides a part of the head.
    const Eigen::Vector3d to_eye =
        view.camera_from_map.OriginInSource() - SignpostArrowPose(view.sign).translation;
    const double ahead = view.sign.direction->dot(to_eye.normalized());
    if (std::abs(ahead) > 0.5 || std::abs(view.sign.up.dot(to_eye.normalized())) > 0.5) continue;
    content::Scene scene;
    scene.entities.emplace_back().signpost = view.sign;
    tracked.camera_from_map = view.camera_from_map;
    const auto head = HeadIn(DrawImage(&renderer, tracked, camera, scene));
    if (!head) continue;  // Seen from behind, the back hides it.
    const Eigen::Vector2d middle =
        *camera.Project(view.camera_from_map * SignpostArrowPose(view.sign).translation);
    EXPECT_LT(AngleTo_deg(*head - middle, view.TrueDirection(camera)), 15) << i;
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

TEST_F(SignpostImage, ShowsNoArrowWithoutADirection) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  content::Scene scene;
  content::Signpost& sign = scene.entities.emplace_back().signpost;
  sign = Sign("Elephants");
  sign.anchor = {0, 0.3, 2};
  sign.height = 0.4;
  const engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
  EXPECT_FALSE(HeadIn(DrawImage(&renderer, tracked, camera, scene)));
  sign.direction = Eigen::Vector3d(1, 0, 0);
  const auto head = HeadIn(DrawImage(&renderer, tracked, camera, scene));
  ASSERT_TRUE(head);
  EXPECT_GT(head->x(), camera.Project(Eigen::Vector3d(0, 0, 2))->x() + 10) << "to the right";
}

}  // namespace
}  // namespace docent::ui
