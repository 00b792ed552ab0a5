// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "content/flat_image.h"
#include "content/picking.h"
#include "tests/ui/ui_testing.h"
#include "ui/entity_shapes.h"
#include "ui/gizmo.h"
#include "ui/label_board.h"
#include "ui/sound_marker.h"
#include "ui/trail_model.h"

// Labels, images, sounds and trails in the image.
namespace docent::ui {
namespace {

using content::Entity;

engine::CameraModel Undistorted() {
  return {engine::LensModel::kRadialTangential, {640, 480, 400, 400, 319.5, 239.5}, {0, 0, 0, 0, 0}};
}

Entity LabelAt(const Eigen::Vector3d& anchor, const Eigen::Vector3d& offset) {
  Entity entity;
  entity.name = "label";
  entity.kind = Entity::Kind::kLabel;
  entity.label.text = "Lion";
  entity.label.translations = {{"de", "Der Löwe im hohen Gras"}};
  entity.label.anchor = anchor;
  entity.label.offset = offset;
  entity.label.text_height = 0.1;
  return entity;
}

Entity ImageAt(const Eigen::Vector3d& place, std::uint8_t red, std::uint8_t green) {
  content::Image image;
  image.width_px = 2;
  image.height_px = 1;
  for (int i = 0; i < 2; ++i) image.rgba.insert(image.rgba.end(), {red, green, 0, 255});
  Entity entity = Facing(content::FlatModel(std::move(image)), place);
  entity.kind = Entity::Kind::kImage;
  return entity;
}

Entity TrailAlong(std::vector<Eigen::Vector3d> points) {
  Entity entity;
  entity.name = "trail";
  entity.kind = Entity::Kind::kTrail;
  entity.trail.points = std::move(points);
  entity.trail.width = 0.3;
  return entity;
}

cv::Mat Drawn(Renderer* renderer, const content::Scene& scene, bool hud, bool markers,
              std::span<const std::string> faint = {}) {
  const engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
  const engine::CameraModel camera = Undistorted();
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.scene = &scene;
  view.overlay.hud = hud;
  view.overlay.status = false;
  view.overlay.markers = markers;
  view.faint = faint;
  renderer->Draw(view);
  cv::Mat image;
  renderer->ReadBack(&image);
  return image;
}

int LitPixels(const cv::Mat& image) {
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return cv::countNonZero(grey);
}

TEST(Label, ItsTextAppearsReadableFromAnyDistance) {
  const content::Label label = LabelAt({0, 0, 2}, {0, -0.5, 0}).label;
  for (const double distance : {0.01, 0.5, 2.0, 8.0, 500.0}) {
    const Eigen::Vector3d eye(0, -0.5, 2 - distance);
    const engine::Sim3 pose = LabelPose(label, eye);
    EXPECT_LT((pose.translation - Eigen::Vector3d(0, -0.5, 2)).norm(), 1e-12);
    EXPECT_GE(pose.scale / distance, 1.0 / 40 - 1e-12);
    EXPECT_LE(pose.scale / distance, 1.0 / 8 + 1e-12);
    EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  }
  EXPECT_DOUBLE_EQ(LabelPose(label, {0, -0.5, 0}).scale, 0.1) << "its own height where that is readable";
}

TEST(Label, IsPickedAtItsBoardAndNotAtItsAnchor) {
  content::Scene scene;
  scene.entities = {LabelAt({0, 0, 2}, {0.2, -0.5, 0})};
  EntityShapes shapes;
  const auto pick = [&](double x, double y) {
    return content::PickEntity({Eigen::Vector3d::Zero(), {x / 2, y / 2, 1}}, scene, shapes.PickOptionsAt(0));
  };
  EXPECT_TRUE(pick(0.2, -0.55));
  EXPECT_FALSE(pick(0, 0));
  EXPECT_FALSE(pick(0.2, -0.45)) << "below the board";
  const auto box = shapes.BoxOf(scene.entities[0], Eigen::Vector3d::Zero());
  ASSERT_TRUE(box);
  EXPECT_LT((box->Base() - Eigen::Vector3d(0.2, -0.5, 2)).norm(), 1e-6);
}

TEST(EntityShapes, ShowTheTextInTheReadersLanguage) {
  const Entity label = LabelAt({0, 0, 2}, {0, 0, 0});
  const auto width = [&](const std::string& language) {
    EntityShapes shapes(language);
    const auto box = shapes.BoxOf(label, Eigen::Vector3d::Zero());
    return box->high.x() - box->low.x();
  };
  EXPECT_GT(width("de-at"), 2 * width(""));
  EXPECT_EQ(width("fr"), width(""));
}

TEST(TrailModel, ARibbonHasItsWidthAndItsArrowsPointAhead) {
  const Entity trail = TrailAlong({{1, 1, 1}, {1, 1, 5}});
  const auto model = MakeTrailModel(trail.trail);
  EXPECT_NEAR(model->bounds_max.x - model->bounds_min.x, 0.3, 1e-5);
  EXPECT_NEAR(model->bounds_max.z - model->bounds_min.z, 4, 1e-5);
  const content::Primitive& arrows = model->meshes[0].primitives[1];
  ASSERT_GE(arrows.indices.size(), 3u * 4);
  for (std::size_t i = 0; i < arrows.indices.size(); i += 3) {
    const auto place = [&](std::size_t k) { return arrows.vertices[arrows.indices[i + k]].position; };
    EXPECT_GT(place(0).z, place(1).z);
    EXPECT_NEAR(place(1).z, place(2).z, 1e-5);
    EXPECT_LT(place(0).y, 0) << "above the ribbon";
  }
}

TEST(TrailModel, EveryCourseGivesFiniteVertices) {
  for (const auto& points : {std::vector<Eigen::Vector3d>{{0, 0, 0}, {0, 0, 0}},
                             std::vector<Eigen::Vector3d>{{0, 0, 0}, {0, -3, 0}},
                             std::vector<Eigen::Vector3d>{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}},
                             std::vector<Eigen::Vector3d>(200, {1e6, -1e6, 1e6})}) {
    Entity trail = TrailAlong(points);
    trail.trail.width = 1e-3;
    const auto model = MakeTrailModel(trail.trail);
    ASSERT_EQ(model->meshes.size(), 1u);
    for (const content::Primitive& primitive : model->meshes[0].primitives) {
      EXPECT_LE(primitive.vertices.size(), 3000u);
      for (const content::Vertex& vertex : primitive.vertices)
        EXPECT_TRUE(std::isfinite(vertex.position.x + vertex.position.y + vertex.position.z));
    }
  }
}

TEST(EntityShapes, ATrailThatIsMovedKeepsItsModel) {
  EntityShapes shapes;
  Entity trail = TrailAlong({{0, 1, 2}, {0, 1, 4}});
  const auto first = shapes.ShapeOf(trail, Eigen::Vector3d::Zero());
  content::SetPose(TranslationBy({1, 0, 0}) * content::PoseOf(trail), &trail);
  const auto moved = shapes.ShapeOf(trail, Eigen::Vector3d::Zero());
  EXPECT_EQ(moved.map_from_model.translation, Eigen::Vector3d(1, 1, 2));
  EXPECT_FALSE(shapes.ShapeOf(TrailAlong({{0, 1, 2}, {0, 1, 5}}), Eigen::Vector3d::Zero()).model ==
               first.model);
}

using EntityKindsImage = OffscreenTest;

TEST_F(EntityKindsImage, ALabelIsDrawnWithItsLeaderLine) {
  Renderer renderer;
  content::Scene scene;
  scene.entities = {LabelAt({0, 0.4, 2}, {0, -0.5, 0})};
  const cv::Mat image = Drawn(&renderer, scene, true, false);
  // The anchor is seen at row 239.5 + 400 * 0.4 / 2 and the board's lower edge at row 239.5 - 400 * 0.1 / 2.
  const auto brightness = [&](int column, int row) {
    return cv::mean(image(cv::Rect(column - 1, row - 1, 3, 3)))[1];
  };
  EXPECT_GT(brightness(320, 320), 150) << "anchor";
  EXPECT_GT(brightness(320, 270), 60) << "line";
  EXPECT_GT(LitPixels(image.rowRange(180, 219)), 100) << "text";
  EXPECT_EQ(LitPixels(image.rowRange(340, 480)), 0);
  scene.entities[0].hidden = true;
  EXPECT_EQ(LitPixels(Drawn(&renderer, scene, true, false)), 0);
  const std::vector<std::string> selected = {scene.entities[0].name};
  const cv::Mat faint = Drawn(&renderer, scene, true, false, selected);
  // The line and the dot at its end lie over each other, each with an opacity of 0.35.
  const double faint_brightness = cv::mean(faint(cv::Rect(319, 319, 3, 3)))[1];
  EXPECT_GT(faint_brightness, 0.3 * brightness(320, 320));
  EXPECT_LT(faint_brightness, 0.6 * brightness(320, 320));
}

TEST_F(EntityKindsImage, TheAreasOfLabelsAreWhereTheyAreDrawn) {
  Renderer renderer;
  content::Scene scene;
  scene.entities = {LabelAt({0, 0.4, 2}, {0, -0.5, 0}), LabelAt({0, 0.4, 2}, {0, -0.5, 0}),
                    LabelAt({10, 0, 40}, {0, 0, 0})};
  for (std::size_t i = 0; i < 3; ++i) scene.entities[i].name = "label-" + std::to_string(i + 1);
  const cv::Mat image = Drawn(&renderer, scene, true, false);
  const std::vector<LabelArea>& areas = renderer.label_areas();
  ASSERT_EQ(areas.size(), 3u);
  EXPECT_EQ(areas[0].entity, "label-3");
  EXPECT_LT((areas[0].area.center() - Eigen::Vector2d(319.5 + 400 * 0.25, 239.5)).norm(), 1e-6)
      << "the dot of a label that is too far away to be read";
  EXPECT_LT(areas[0].area.sizes().maxCoeff(), 30);
  EXPECT_EQ(areas[1].entity, "label-1");
  EXPECT_EQ(areas[2].entity, "label-2");
  EXPECT_FALSE(areas[1].area.intersects(areas[2].area));
  for (const LabelArea& label : areas) {
    const Eigen::Vector2i low = label.area.min().array().ceil().matrix().cast<int>();
    const Eigen::Vector2i size = label.area.max().array().floor().matrix().cast<int>() - low;
    EXPECT_GT(LitPixels(image(cv::Rect(low.x(), low.y(), size.x(), size.y()))), 10) << label.entity;
  }
  scene.entities[2].hidden = true;
  Drawn(&renderer, scene, true, false);
  EXPECT_EQ(renderer.label_areas().size(), 2u);
}

TEST_F(EntityKindsImage, ALabelHasTheResolutionOfTheTextsOverTheImage) {
  Renderer renderer;
  content::Scene scene;
  scene.entities = {LabelAt({0, 0.4, 2}, {0, -0.5, 0})};
  EXPECT_EQ(LitPixels(Drawn(&renderer, scene, false, false)), 0)
      << "a window draws the image without texts, and these at its own resolution";
}

TEST_F(EntityKindsImage, AnImageIsDrawnAtItsPlaceInItsColoursAndHidesWhatIsBehind) {
  Renderer renderer;
  content::Scene scene;
  scene.entities = {ImageAt({0, 0, 2}, 200, 60)};
  const cv::Mat image = Drawn(&renderer, scene, false, false);
  EXPECT_NEAR(image.at<cv::Vec3b>(240, 320)[2], 200, 2);
  EXPECT_NEAR(image.at<cv::Vec3b>(240, 320)[1], 60, 2);
  // One map unit wide and half as high, at a distance of two: 200 x 100 pixels.
  EXPECT_NEAR(LitPixels(image), 200 * 100, 900);
  scene.entities.push_back(ImageAt({0, 0, 1.5}, 10, 220));
  scene.entities.back().name = "nearer";
  EXPECT_NEAR(Drawn(&renderer, scene, false, false).at<cv::Vec3b>(240, 320)[1], 220, 2);
  std::swap(scene.entities[0], scene.entities[1]);
  EXPECT_NEAR(Drawn(&renderer, scene, false, false).at<cv::Vec3b>(240, 320)[1], 220, 2);
}

TEST_F(EntityKindsImage, ATrailIsDrawnAlongItsPoints) {
  Renderer renderer;
  content::Scene scene;
  scene.entities = {TrailAlong({{0, 1, 2}, {0, 1, 6}})};
  const cv::Mat image = Drawn(&renderer, scene, false, false);
  // Between the ends it is seen at these rows: 239.5 + 400 / depth.
  for (const double depth : {2.3, 3.0, 4.0, 5.5}) {
    const int row = static_cast<int>(std::lround(239.5 + 400 / depth));
    EXPECT_GT(LitPixels(image(cv::Rect(317, row, 6, 1))), 0) << depth;
    EXPECT_EQ(LitPixels(image(cv::Rect(450, row, 50, 1))), 0) << depth;
  }
}

TEST_F(EntityKindsImage, OnlyAuthorsSeeWhereSoundsAre) {
  Renderer renderer;
  content::Scene scene;
  Entity sound;
  sound.name = "roar";
  sound.kind = Entity::Kind::kSound;
  sound.sound.position = {0.3, 0, 2};
  scene.entities = {sound};
  EXPECT_EQ(LitPixels(Drawn(&renderer, scene, true, false)), 0);
  const cv::Mat image = Drawn(&renderer, scene, false, true);
  ASSERT_GT(LitPixels(image), 100);
  EXPECT_NEAR(Centroid(image).x(), 319.5 + 400 * 0.15, 3);
  EXPECT_NEAR(Centroid(image).y(), 239.5, 3);
}

TEST_F(EntityKindsImage, ACaptionIsShownBelow) {
  Renderer renderer;
  const engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
  const engine::CameraModel camera = Undistorted();
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.overlay.status = false;
  const auto lit = [&] {
    renderer.Draw(view);
    cv::Mat image;
    renderer.ReadBack(&image);
    return LitPixels(image.rowRange(400, 480));
  };
  const int without = lit();
  view.overlay.caption = "The lion roars.";
  EXPECT_GT(lit(), without + 100);
}

}  // namespace
}  // namespace docent::ui
