// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/ui/ui_testing.h"
#include "ui/card_targets.h"
#include "ui/card_view.h"
#include "ui/label_board.h"
#include "ui/theme.h"
#include "ui/visitor_layout.h"

namespace docent::ui {
namespace {

const engine::CameraModel kTargetCamera(engine::LensModel::kRadialTangential,
                                        {640, 480, 500, 500, 319.5, 239.5}, {});

TEST(CardTargets, CoverWhatIsSeenAndComeNearestToTheMiddleFirst) {
  content::Scene scene;
  const auto add = [&](const std::string& name, const Eigen::Vector3d& place, float side) {
    content::Entity entity = Facing(SquareModel(side, {1, 1, 1, 1}), place);
    entity.model.asset = [&] {
      auto asset = std::make_shared<content::Asset>(*entity.model.asset);
      auto model = std::make_shared<content::Model>(*asset->model);
      model->bounds_min = glm::vec3(-0.5f * side, -0.5f * side, 0);
      model->bounds_max = glm::vec3(0.5f * side, 0.5f * side, 0);
      asset->model = model;
      return asset;
    }();
    entity.name = name;
    scene.entities.push_back(entity);
  };
  add("aside", {0.8, 0, 2}, 0.2f);
  add("ahead", {0, 0, 2}, 0.4f);
  add("behind", {0, 0, -2}, 0.4f);
  add("outside", {6, 0, 2}, 0.4f);
  add("tiny", {0, 0.1, 2}, 0.01f);
  EntityShapes shapes;
  const auto targets = FindCardTargets(scene, kTargetCamera, {}, &shapes);
  ASSERT_EQ(targets.size(), 2u);
  EXPECT_EQ(targets[0].entity, "ahead");
  EXPECT_EQ(targets[1].entity, "aside");
  // A square of 0.4 at a distance of 2 spans 100 pixels of a lens with 500.
  EXPECT_LT((targets[0].low - Eigen::Vector2d(269.5, 189.5)).norm(), 1e-4);
  EXPECT_LT((targets[0].high - Eigen::Vector2d(369.5, 289.5)).norm(), 1e-4);
}

// A model with these bounds in the axes of the map.
content::Entity WithBounds(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  auto model = SquareModel(1, {1, 1, 1, 1});
  model->bounds_min = glm::vec3(low.x(), low.y(), low.z());
  model->bounds_max = glm::vec3(high.x(), high.y(), high.z());
  content::Entity entity = Facing(model, {0, 0, 1});
  entity.name = "large";
  entity.model.map_from_model = {};
  return entity;
}

TEST(CardTargets, WhatReachesBeyondTheViewIsOpenedWhereItIsSeen) {
  const auto targets = [](const content::Entity& entity, const engine::CameraModel& camera) {
    content::Scene scene;
    scene.entities.push_back(entity);
    EntityShapes shapes;
    return FindCardTargets(scene, camera, {}, &shapes);
  };
  const Eigen::Vector2d first(0, 0), last(639, 479);
  const auto beside = targets(WithBounds({0.5, -0.5, -1}, {1.5, 0.5, 3}), kTargetCamera);
  ASSERT_EQ(beside.size(), 1u);
  EXPECT_NEAR(beside[0].low.x(), 319.5 + 500 * 0.5 / 3, 1e-3) << "its farthest edge";
  EXPECT_EQ(beside[0].high, last);
  EXPECT_TRUE(targets(WithBounds({0.5, -0.5, -3}, {1.5, 0.5, 0.1}), kTargetCamera).empty())
      << "it is outside the image";
  const auto around = targets(WithBounds({-1, -1, -1}, {1, 1, 1}), kTargetCamera);
  ASSERT_EQ(around.size(), 1u);
  EXPECT_EQ(around[0].low, first);
  EXPECT_EQ(around[0].high, last);
  // This lens is one-to-one up to 46 degrees, and sees no edge of the wall.
  const engine::CameraModel narrow(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 319.5, 239.5},
                                   {-0.3, 0, 0, 0, 0});
  const auto wall = targets(WithBounds({-20, -20, 1}, {20, 20, 1.2}), narrow);
  ASSERT_EQ(wall.size(), 1u);
  EXPECT_EQ(wall[0].low, first);
  EXPECT_EQ(wall[0].high, last);
}

// A label whose board stands this far above what it is about.
content::Entity LabelAbove(const Eigen::Vector3d& anchor, double height) {
  content::Entity entity;
  entity.name = "label";
  entity.kind = content::Entity::Kind::kLabel;
  entity.label.text = "Restored in 1874";
  entity.label.anchor = anchor;
  entity.label.offset = {0, -height, 0};
  entity.label.text_height = 0.1;
  return entity;
}

std::vector<CardTarget> TargetsOf(const content::Entity& entity) {
  content::Scene scene;
  scene.entities.push_back(entity);
  EntityShapes shapes;
  return FindCardTargets(scene, kTargetCamera, {}, &shapes);
}

TEST(CardTargets, ALabelThatIsNotDrawnCannotBeOpenedAndAFarOneIsItsDot) {
  EXPECT_EQ(TargetsOf(LabelAbove({0, 0.5, 2}, 0.4)).size(), 1u);
  EXPECT_TRUE(TargetsOf(LabelAbove({0, 1.2, 2}, 0.1)).empty()) << "its board would begin below the image";
  const auto far = TargetsOf(LabelAbove({3, 0, 20}, 2));
  ASSERT_EQ(far.size(), 1u);
  const Eigen::Vector2d dot(319.5 + 500 * 3 / 20.0, 239.5);
  EXPECT_LT((0.5 * (far[0].low + far[0].high) - dot).norm(), 1e-6);
  EXPECT_LT((far[0].high - far[0].low).norm(), 30);
}

class CardTargetsInAnImage : public OffscreenTest {};

// What the visitor is told stands where the label would be.
TEST_F(CardTargetsInAnImage, AMovedLabelIsOpenedAndMarkedWhereItIsDrawn) {
  content::Scene scene;
  scene.entities.push_back(LabelAbove({-0.8, 0, 2}, 0.7));
  const cv::Mat grey(480, 640, CV_8UC3, cv::Scalar::all(128));
  engine::TrackedFrame tracked = Tracked(grey);
  View view;
  view.tracked = &tracked;
  view.camera = &kTargetCamera;
  view.scene = &scene;
  view.overlay.visitor.emplace();
  view.overlay.visitor->place = "Ships of the third century";
  view.overlay.visitor->targets = TargetsOf(scene.entities.front());
  ASSERT_EQ(view.overlay.visitor->targets.size(), 1u);
  const CardTarget before = view.overlay.visitor->targets.front();
  Renderer renderer;
  cv::Mat plain, marked;
  renderer.Draw(view);
  renderer.ReadBack(&plain);
  ASSERT_EQ(renderer.card_targets().size(), 1u);
  const CardTarget drawn = renderer.card_targets().front();
  EXPECT_GT((drawn.low - before.low).norm(), 10);
  const cv::Vec3b inside = plain.at<cv::Vec3b>(static_cast<int>(drawn.high.y()) - 4,
                                               static_cast<int>(0.5 * (drawn.low.x() + drawn.high.x())));
  EXPECT_LT(inside[0], 100) << "the board is darker than the image";
  view.overlay.visitor->marked = 0;
  renderer.Draw(view);
  renderer.ReadBack(&marked);
  cv::Mat difference, changed;
  cv::absdiff(plain, marked, difference);
  cv::cvtColor(difference, difference, cv::COLOR_BGR2GRAY);
  cv::findNonZero(difference, changed);
  const cv::Rect frame = cv::boundingRect(changed);
  EXPECT_NEAR(frame.x, drawn.low.x(), 12);
  EXPECT_NEAR(frame.y, drawn.low.y(), 12);
  EXPECT_NEAR(frame.br().x, drawn.high.x(), 12);
  EXPECT_NEAR(frame.br().y, drawn.high.y(), 12);
}

TEST(CardTargets, ATouchMeansTheSmallestThingItHitsElseTheNearestWithinAFingertip) {
  const std::vector<CardTarget> targets = {
      {"wall", {0, 0}, {400, 300}}, {"mask", {100, 100}, {140, 140}}, {"vase", {500, 100}, {540, 140}}};
  const auto name = [&](double x, double y) {
    const CardTarget* const target = TargetAt(targets, {x, y}, 20);
    return target != nullptr ? target->entity : std::string();
  };
  EXPECT_EQ(name(120, 120), "mask");
  EXPECT_EQ(name(200, 200), "wall");
  EXPECT_EQ(name(550, 130), "vase");
  EXPECT_EQ(name(561, 130), "");
  EXPECT_EQ(name(450, 250), "");
}

// Displays of visitors: a small tablet, a laptop, a large tablet upright and across. Pixels, and pixels per
// millimetre.
struct TestDisplay {
  int width_px, height_px;
  double pixels_per_mm;
};
constexpr std::array<TestDisplay, 4> kDisplays = {
    {{800, 480, 5.2}, {1280, 800, 5.9}, {1920, 1200, 8.9}, {1200, 1920, 8.9}}};

HeadsUpStyle StyleOf(const TestDisplay& display) {
  return {VisitorUnit_px(display.width_px, display.height_px, display.pixels_per_mm), 0,
          kTouchTarget_mm * display.pixels_per_mm};
}

// The height of a capital letter in an image of text, which has no other letters.
int CapitalHeight_px(double size_px) {
  TextStyle style;
  style.size_px = size_px;
  const cv::Mat image = DrawText("HHH", style);
  int first = -1, last = -1;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (image.at<cv::Vec4b>(y, x)[3] < 128) continue;
      if (first < 0) first = y;
      last = y;
    }
  }
  return last - first + 1;
}

TEST(VisitorTexts, SpanTwoFifthsOfADegreeOnEveryDisplay) {
  for (const TestDisplay& display : kDisplays) {
    const double unit = StyleOf(display).unit_px;
    const double letter_mm = CapitalHeight_px(15 * unit) / display.pixels_per_mm;
    const double angle_deg = std::atan2(letter_mm, kReadingDistance_mm) * 180 / std::numbers::pi;
    EXPECT_GE(angle_deg, kLeastLetter_deg - 0.03) << display.width_px << "x" << display.height_px;
    EXPECT_GE(std::min(display.width_px, display.height_px) / unit, 300) << "there is room for sentences";
  }
}

// An overlay with a card of this text.
Overlay WithCard(const std::string& text, bool with_model, bool right_to_left) {
  Overlay overlay;
  overlay.visitor.emplace();
  overlay.visitor->is_right_to_left = right_to_left;
  Card& card = overlay.visitor->card.emplace();
  card.entity = "vase";
  card.text = text;
  card.hint = "Press to close.";
  if (with_model)
    card.shown = std::make_shared<content::Entity>(Facing(SquareModel(1, {0, 1, 0, 1}), {0, 0, 2}));
  return overlay;
}

bool Overlap(const Area& a, const Area& b) {
  return a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom();
}

TEST(CardLayout, KeepsItsPartsApartAndItsButtonLarge) {
  for (const TestDisplay& display : kDisplays) {
    for (const bool right_to_left : {false, true}) {
      for (const bool with_model : {false, true}) {
        SCOPED_TRACE(testing::Message()
                     << display.width_px << "x" << display.height_px << right_to_left << with_model);
        const Overlay overlay = WithCard("Text.", with_model, right_to_left);
        const HeadsUpStyle style = StyleOf(display);
        const CardLayout layout = LayOutCard(overlay, display.width_px, display.height_px, style);
        EXPECT_GE(layout.close.width, 9 * display.pixels_per_mm);
        EXPECT_GE(layout.close.height, 9 * display.pixels_per_mm);
        EXPECT_GE(layout.text.width, 0.3 * display.width_px);
        EXPECT_EQ(layout.shown.width > 0, with_model);
        for (const Area& part : {layout.close, layout.text, layout.hint, layout.shown}) {
          EXPECT_GE(part.x, 0);
          EXPECT_LE(part.right(), display.width_px);
          EXPECT_LE(part.bottom(), display.height_px);
        }
        EXPECT_FALSE(Overlap(layout.close, layout.text));
        EXPECT_FALSE(Overlap(layout.text, layout.hint));
        EXPECT_FALSE(Overlap(layout.text, layout.shown));
      }
    }
  }
}

TEST(MenuLayout, HasChoicesThatAFingertipHits) {
  VisitorDisplay visitor;
  visitor.has_menu_button = true;
  visitor.menu = {"Skip", "Back", "Stops", "Close"};
  for (const TestDisplay& display : kDisplays) {
    const MenuLayout layout = LayOutMenu(visitor, display.width_px, display.height_px, StyleOf(display));
    ASSERT_EQ(layout.choices.size(), 4u);
    for (const Area& area : layout.choices) {
      EXPECT_GE(std::min(area.width, area.height), 9 * display.pixels_per_mm);
      EXPECT_GE(area.y, 0);
      EXPECT_LE(area.bottom(), display.height_px);
    }
    EXPECT_GE(layout.button.width, 9 * display.pixels_per_mm);
    EXPECT_FALSE(Overlap(layout.choices[0], layout.choices[1]));
  }
}

class CardView : public OffscreenTest {};

TEST_F(CardView, ShowsTheModelAloneWhateverItsPlaceAndTurnsItByHand) {
  Renderer renderer;
  const cv::Mat noise = NoiseImage(640, 480, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(noise);
  View view;
  view.tracked = &tracked;
  view.camera = &kTargetCamera;
  view.overlay = WithCard("", true, false);
  const auto green_pixels = [&](const Eigen::Vector2d& turned_rad) {
    view.overlay.visitor->card->turned_rad = turned_rad;
    renderer.Draw(view);
    cv::Mat image;
    renderer.ReadBack(&image);
    int count = 0;
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const cv::Vec3b pixel = image.at<cv::Vec3b>(y, x);
        if (pixel[1] > 200 && pixel[0] < 60 && pixel[2] < 60) ++count;
      }
    }
    return count;
  };
  const int front = green_pixels({0, 0});
  EXPECT_GT(front, 0.05 * 640 * 480);
  // A square that is turned about one of its axes looks narrower by the cosine, at first order.
  EXPECT_NEAR(green_pixels({std::numbers::pi / 3, 0}), 0.5 * front, 0.12 * front);
  EXPECT_NEAR(green_pixels({0, std::numbers::pi / 3}), 0.5 * front, 0.12 * front);
  EXPECT_LT(green_pixels({std::numbers::pi / 2, 0}), 0.05 * front);
}

TEST_F(CardView, CoversTheVideoWithAnEvenGroundOfEnoughContrast) {
  Renderer renderer;
  const cv::Mat noise = NoiseImage(640, 480, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(noise);
  View view;
  view.tracked = &tracked;
  view.camera = &kTargetCamera;
  view.overlay = WithCard(
      "Vases of the third century were found in the harbour in 1874, when its "
      "bottom was deepened for steamers; most of them still held the oil of olives from the "
      "south.",
      false, false);
  renderer.Draw(view);
  cv::Mat image;
  renderer.ReadBack(&image);
  const cv::Vec3b ground = image.at<cv::Vec3b>(300, 320);
  cv::Vec3b brightest = ground;
  int even = 0, all = 0;
  for (int y = 40; y < 440; ++y) {
    for (int x = 40; x < 500; ++x, ++all) {
      const cv::Vec3b pixel = image.at<cv::Vec3b>(y, x);
      if (pixel == ground) ++even;
      if (pixel[1] > brightest[1]) brightest = pixel;
    }
  }
  EXPECT_GT(even, 0.8 * all);
  const auto color = [](const cv::Vec3b& pixel) {
    return Color{static_cast<float>(pixel[2]) / 255, static_cast<float>(pixel[1]) / 255,
                 static_cast<float>(pixel[0]) / 255, 1};
  };
  EXPECT_GE(theme::ContrastRatio(color(brightest), color(ground)), 7);
}

}  // namespace
}  // namespace docent::ui
