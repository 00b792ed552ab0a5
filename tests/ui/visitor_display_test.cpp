// SPDX-License-Identifier: Apache-2.0
#include "ui/visitor_display.h"

#include <opencv2/imgproc.hpp>

#include "tests/ui/ui_testing.h"
#include "ui/label_board.h"
#include "ui/renderer.h"

namespace docent::ui {
namespace {

const engine::CameraModel kViewsCamera(engine::LensModel::kRadialTangential,
                                       {640, 480, 500, 500, 319.5, 239.5}, {});

class KnownViews : public OffscreenTest {};

TEST_F(KnownViews, HaveTheNamesOfTheirPlacesBelowThem) {
  Renderer renderer;
  const cv::Mat black = cv::Mat::zeros(480, 640, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(black);
  View view;
  view.tracked = &tracked;
  view.camera = &kViewsCamera;
  const auto drawn = [&](const std::string& name) {
    view.overlay.visitor.emplace();
    view.overlay.visitor->views = {{cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)), name},
                                   {cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)), ""}};
    renderer.Draw(view);
    cv::Mat image;
    renderer.ReadBack(&image);
    return image;
  };
  const cv::Mat without = drawn(""), with = drawn("Lions");
  cv::Mat difference;
  cv::cvtColor(cv::abs(with - without), difference, cv::COLOR_BGR2GRAY);
  const cv::Rect name = cv::boundingRect(difference > 8);
  ASSERT_GT(name.area(), 100) << "the name is drawn";
  const Inset first = PlaceViews(*view.overlay.visitor, 640, 480)[0];
  EXPECT_GE(name.y, first.y + first.height) << "it does not cover the image";
  EXPECT_LE(name.br().y, first.y + first.height + 60);
  EXPECT_GE(name.x, first.x);
  EXPECT_LE(name.br().x, first.x + first.width);
  EXPECT_NEAR(name.x + 0.5 * name.width, first.x + 0.5 * first.width, 2);
}

class LabelsOfVisitors : public OffscreenTest {};

TEST_F(LabelsOfVisitors, KeepClearOfThePlaceTheTourAndTheSentence) {
  Renderer renderer;
  const cv::Mat black = cv::Mat::zeros(480, 640, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(black);
  content::Scene scene;
  // What they are about is in the middle, and their boards would lie in the corner and at the bottom.
  for (const Eigen::Vector3d& offset : {Eigen::Vector3d(-0.6, -0.75, 0), Eigen::Vector3d(0.3, 0.85, 0)}) {
    content::Entity& label = scene.entities.emplace_back();
    label.name = "label-" + std::to_string(scene.entities.size());
    label.kind = content::Entity::Kind::kLabel;
    label.label.text = "Restored";
    label.label.anchor = {-0.3, 0, 2};
    label.label.offset = offset;
    label.label.text_height = 0.1;
  }
  View view;
  view.tracked = &tracked;
  view.camera = &kViewsCamera;
  const auto drawn = [&](bool with_words, bool with_labels) {
    view.overlay.visitor.emplace();
    if (with_words) {
      view.overlay.visitor->place = "Lions";
      view.overlay.visitor->route_line = "Stop 1 of 8. Next: Clocks";
      view.overlay.visitor->sentence = "Look around slowly.";
    }
    view.scene = with_labels ? &scene : nullptr;
    renderer.Draw(view);
    cv::Mat image;
    renderer.ReadBack(&image);
    cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
    return image;
  };
  const cv::Mat nothing = drawn(false, false), words = drawn(true, false);
  const cv::Mat where_words_are = cv::abs(words - nothing) > 8;
  const auto covered = [&](const cv::Mat& before, const cv::Mat& after) {
    return cv::countNonZero((cv::abs(after - before) > 8) & where_words_are);
  };
  ASSERT_GT(cv::countNonZero(where_words_are), 2000);
  ASSERT_GT(covered(nothing, drawn(false, true)), 100) << "without words the labels lie there";
  const cv::Mat both = drawn(true, true);
  EXPECT_GT(cv::countNonZero(cv::abs(both - words) > 8), 500) << "the labels are drawn";
  EXPECT_EQ(covered(words, both), 0);
}

TEST_F(LabelsOfVisitors, AreNotReadThroughTheNameOfAPlaceThatIsReached) {
  Renderer renderer;
  const cv::Mat black = cv::Mat::zeros(480, 640, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(black);
  content::Scene scene;
  content::Entity& label = scene.entities.emplace_back();
  label.name = "label";
  label.kind = content::Entity::Kind::kLabel;
  label.label.text = "Restored in 1931, with the help of the brothers Hansen";
  label.label.anchor = {0, 0, 2};
  label.label.offset = {0, -0.5, 0};
  label.label.text_height = 0.1;
  View view;
  view.tracked = &tracked;
  view.camera = &kViewsCamera;
  const auto drawn = [&](double arrival, bool with_label) {
    view.overlay.visitor.emplace();
    view.overlay.visitor->place = "Lions";
    view.overlay.visitor->arrival = arrival;
    view.scene = with_label ? &scene : nullptr;
    renderer.Draw(view);
    cv::Mat image;
    renderer.ReadBack(&image);
    cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
    return image;
  };
  const cv::Mat nothing = drawn(0, false), name = drawn(1, false);
  cv::Rect inside = cv::boundingRect(cv::abs(name - nothing) > 8);
  ASSERT_GT(inside.area(), 2000);
  // Without the rounded corners.
  constexpr int kCorner_px = 16;
  inside = {inside.x + kCorner_px, inside.y + kCorner_px, inside.width - 2 * kCorner_px,
            inside.height - 2 * kCorner_px};
  const auto changed = [&](const cv::Mat& before, const cv::Mat& after) {
    return cv::countNonZero(cv::abs(after(inside) - before(inside)) > 8);
  };
  ASSERT_GT(changed(nothing, drawn(0, true)), 100) << "the label lies there";
  EXPECT_EQ(changed(name, drawn(1, true)), 0);
}

TEST_F(LabelsOfVisitors, AreNotCutOffAtTheEdge) {
  content::Scene scene;
  // Their points are seen just inside the right edge and the upper one.
  for (const Eigen::Vector3d& anchor : {Eigen::Vector3d(1.25, 0, 2), Eigen::Vector3d(0, -0.9, 2)}) {
    content::Entity& label = scene.entities.emplace_back();
    label.name = "label-" + std::to_string(scene.entities.size());
    label.kind = content::Entity::Kind::kLabel;
    label.label.text = "Restored in 1931";
    label.label.anchor = anchor;
    label.label.text_height = 0.1;
  }
  Canvas canvas;
  canvas.Begin(640, 480);
  const std::string language;
  const engine::Rigid3 identity;
  const LabelView seen{kViewsCamera, identity, FitImage(640, 480, 640, 480), language};
  const std::vector<DrawnBoard> boards = DrawLabels(scene, seen, &canvas);
  ASSERT_EQ(boards.size(), 2u);
  const Eigen::AlignedBox2d window(Eigen::Vector2d(0, 0), Eigen::Vector2d(640, 480));
  for (const DrawnBoard& drawn : boards) EXPECT_TRUE(window.contains(drawn.board));
}

TEST_F(LabelsOfVisitors, AreNotDrawnSmallerThanCanBeRead) {
  content::Scene scene;
  content::Entity& label = scene.entities.emplace_back();
  label.name = "label-1";
  label.kind = content::Entity::Kind::kLabel;
  label.label.text = "Restored in 1931";
  label.label.anchor = {0, 0, 4};
  label.label.text_height = 0.05;
  Canvas canvas;
  canvas.Begin(640, 480);
  const std::string language;
  const engine::Rigid3 identity;
  const auto height = [&](double least_text_px) {
    LabelView seen{kViewsCamera, identity, FitImage(640, 480, 640, 480), language};
    seen.least_text_px = least_text_px;
    const std::vector<DrawnBoard> boards = DrawLabels(scene, seen, &canvas);
    return boards.size() == 1 ? boards[0].board.sizes().y() : 0;
  };
  const double small = height(0);
  ASSERT_GT(small, 0);
  EXPECT_EQ(height(1), small);
  // A line of text and its padding are proportional to the text's size.
  EXPECT_NEAR(height(40) / height(20), 2, 0.1);
  EXPECT_GT(height(40), 40);
}

class CornerLines : public OffscreenTest {};

TEST_F(CornerLines, ALongOneHasTwoRowsInsteadOfBeingCut) {
  Canvas canvas;
  canvas.Begin(640, 480);
  const auto height = [&](const std::string& line) {
    View view;
    view.overlay.visitor.emplace().route_line = line;
    return TakenByVisitorDisplay(view, {1, 0, 0}, &canvas).at(0).sizes().y();
  };
  const double short_px = height("Zu Ende");
  // The width is 60 % of the window's.
  EXPECT_GT(height("Die Führung endet hier. Sie haben alle 12 Stationen gesehen."), short_px + 14);
}

TEST(TextDirection, IsThatOfMostOfItsLetters) {
  const auto looks_equal = [](const std::string& a, const std::string& b) {
    const cv::Mat first = DrawText(a, {}), second = DrawText(b, {});
    return first.size() == second.size() && cv::norm(first, second, cv::NORM_INF) == 0;
  };
  const std::string arabic =
      "Ships: \u0627\u0644\u0641\u064a\u0644 \u0627\u0644\u0623\u0641\u0631\u064a\u0642\u064a.";
  const std::string english = "The word \u0641\u064a\u0644 means elephant.";
  EXPECT_TRUE(looks_equal(arabic, "\u200f" + arabic));
  EXPECT_TRUE(looks_equal(english, "\u200e" + english));
  const std::string english_after_name = "\u05d3\u05d5\u05d3 wrote most of these songs.";
  EXPECT_TRUE(looks_equal(english_after_name, "\u200e" + english_after_name));
}

TEST(TextDirection, IsThatOfEachLine) {
  // The darkness of the columns from the first one with a letter to the last one.
  const auto columns = [](const cv::Mat& image) {
    cv::Mat alpha, sums;
    cv::extractChannel(image, alpha, 3);
    const cv::Rect letters = cv::boundingRect(alpha);
    cv::reduce(alpha(letters), sums, 0, cv::REDUCE_SUM, CV_32F);
    return sums;
  };
  const std::string arabic =
      "\u0627\u0644\u0641\u064a\u0644 \u0627\u0644\u0623\u0641\u0631\u064a\u0642\u064a.";
  const cv::Mat alone = DrawText("The hall.", {}), both = DrawText(arabic + "\nThe hall.", {});
  // The Arabic line begins at the right of the block, the English one at its left.
  ASSERT_GT(both.cols, 4 * alone.cols);
  const cv::Mat expected = columns(alone), drawn = columns(both.colRange(0, both.cols / 2));
  ASSERT_EQ(drawn.size(), expected.size());
  EXPECT_LT(cv::norm(drawn, expected, cv::NORM_L1), 0.05 * cv::norm(expected, cv::NORM_L1))
      << "its full stop is at its right end";
}

class WayOnOfVisitors : public OffscreenTest {};

TEST_F(WayOnOfVisitors, HasItsTextWhereItDoesNotCoverTheSignpost) {
  const cv::Mat black = cv::Mat::zeros(480, 640, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(black);
  content::Scene scene;
  content::Entity& sign = scene.entities.emplace_back();
  sign.name = "sign";
  sign.kind = content::Entity::Kind::kSignpost;
  sign.signpost.text = "To the clocks";
  sign.signpost.anchor = {0.95, 0.4, 2};
  sign.signpost.height = 0.3;
  const std::vector<Eigen::AlignedBox2d> boards = SignBoards(scene, kViewsCamera, tracked.camera_from_map);
  ASSERT_EQ(boards.size(), 1u);
  View view;
  view.tracked = &tracked;
  view.camera = &kViewsCamera;
  view.overlay.visitor.emplace();
  view.overlay.visitor->way_on.emplace();
  view.overlay.visitor->way_on->text = "To Clocks";
  view.overlay.visitor->way_on->arrow.tip = {614, boards[0].center().y()};
  Canvas canvas;
  canvas.Begin(640, 480);
  const auto placed = [&](const content::Scene* seen) {
    view.scene = seen;
    return TakenByVisitorDisplay(view, {1, 0, 0}, &canvas);
  };
  const auto without = placed(nullptr), with = placed(&scene);
  // The arrow, and its text.
  ASSERT_EQ(without.size(), 2u);
  ASSERT_EQ(with.size(), 2u);
  for (const std::size_t part : {0, 1}) {
    EXPECT_TRUE(without[part].intersects(boards[0])) << "else it would stand behind it";
    EXPECT_FALSE(with[part].intersects(boards[0]))
        << with[part].min().transpose() << ", " << with[part].max().transpose() << "; "
        << boards[0].min().transpose() << ", " << boards[0].max().transpose();
    EXPECT_TRUE(Eigen::AlignedBox2d(Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 479)).contains(with[part]));
  }
  EXPECT_FALSE(with[0].intersects(with[1]));
  view.overlay.visitor->menu = {"Skip the next stop"};
  EXPECT_EQ(placed(&scene).size(), 1u) << "behind a menu the way would be seen in part";
}

}  // namespace
}  // namespace docent::ui
