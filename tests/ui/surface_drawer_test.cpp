// SPDX-License-Identifier: Apache-2.0
#include "ui/surface_drawer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/ui/ui_testing.h"

namespace docent::ui {
namespace {

// A rectangle of the plane z = depth in the map.
std::shared_ptr<const engine::SurfaceMesh> Screen(float left, float right, float depth) {
  auto mesh = std::make_shared<engine::SurfaceMesh>();
  mesh->vertices = {{left, -9, depth}, {right, -9, depth}, {right, 9, depth}, {left, 9, depth}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

class SurfaceDrawerTest : public OffscreenTest {
 protected:
  // Draws a green square of 1 x 1 units at a depth over a black image.
  cv::Mat Draw(double content_depth, std::shared_ptr<const engine::SurfaceMesh> surfaces,
               const engine::CameraModel& camera = StronglyDistorted()) {
    if (renderer_ == nullptr) renderer_ = std::make_unique<Renderer>();
    content::Scene scene;
    scene.entities.push_back(Facing(SquareModel(1.0f, glm::vec4(0, 1, 0, alpha_)), {0, 0, content_depth}));
    const cv::Mat black = cv::Mat::zeros(camera.height_px(), camera.width_px(), CV_8UC3);
    const engine::TrackedFrame tracked = Tracked(video_.empty() ? black : video_);
    View view;
    view.tracked = &tracked;
    view.camera = &camera;
    view.scene = &scene;
    view.surfaces = std::move(surfaces);
    view.shadows = false;
    scene.entities.insert(scene.entities.end(), occluders_.begin(), occluders_.end());
    view.occluders = occluders_count_;
    view.overlay.markers = markers_;
    view.overlay.hud = false;
    renderer_->Draw(view);
    cv::Mat image;
    renderer_->ReadBack(&image);
    return image;
  }
  // A rectangle of 18 units in height across the z axis of the map.
  static content::Entity PlacedScreen(double left, double right, double depth) {
    content::Entity entity;
    entity.kind = content::Entity::Kind::kOccluder;
    entity.occluder.shape = content::Occluder::Shape::kPlane;
    entity.occluder.size = {right - left, 18, 0};
    entity.occluder.map_from_shape.translation = {0.5 * (left + right), 0, depth};
    return entity;
  }
  std::vector<content::Entity> occluders_;  // In the drawn scenes.
  bool occluders_count_ = true, markers_ = false;
  cv::Mat video_;  // Empty: black.
  float alpha_ = 1;
  static int Green(const cv::Mat& image) {
    cv::Mat channel;
    cv::extractChannel(image, channel, 1);
    return cv::countNonZero(channel > 127);
  }

 private:
  std::unique_ptr<Renderer> renderer_;  // Needs the context of the fixture.
};

TEST_F(SurfaceDrawerTest, HidesContentBehindASurface) {
  const int all = Green(Draw(2, nullptr));
  ASSERT_GT(all, 10'000);
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 1))), 0);
  EXPECT_NEAR(Green(Draw(2, Screen(-9, 0, 1))), 0.5 * all, 0.01 * all);
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 3))), all) << "the surface is behind";
  EXPECT_EQ(Green(Draw(2, nullptr)), all) << "the surfaces of earlier images are forgotten";
}

TEST_F(SurfaceDrawerTest, ShowsContentThatStandsOnASurface) {
  const int all = Green(Draw(2, nullptr));
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 2))), all);
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 1.97F))), all) << "within the depth bias";
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 1.93F))), 0);
}

TEST_F(SurfaceDrawerTest, HidesContentBehindASurfaceAtTheCamera) {
  EXPECT_EQ(Green(Draw(50, Screen(-9, 9, 0.01F))), 0);
  ASSERT_GT(Green(Draw(100, nullptr)), 0);
  EXPECT_EQ(Green(Draw(100, Screen(-9, 9, 0.01F))), 0) << "content of little extent in depth";
}

TEST_F(SurfaceDrawerTest, PutsEdgesWhereTheLensShowsThem) {
  // The left edge of the surface is the plane x = 0.15 at depth 1, which the lens bends.
  const engine::CameraModel camera = StronglyDistorted();
  const cv::Mat image = Draw(1.5, Screen(0.15F, 9, 1));
  for (const double y : {-0.25, 0.0, 0.25}) {
    const auto edge = camera.Project({0.15, y, 1});
    ASSERT_TRUE(edge);
    int visible = 0;
    const int row = static_cast<int>(std::lround(edge->y()));
    for (int x = 0; x < image.cols; ++x) {
      if (image.at<cv::Vec3b>(row, x)[1] > 127) visible = x;
    }
    EXPECT_NEAR(visible + 0.5, edge->x(), 1.0) << "in row " << row;
  }
}

TEST_F(SurfaceDrawerTest, PutsEdgesOnTheEdgesOfTheImageNearThem) {
  // The surface ends at x = 0.15, where the image has its edge two pixels farther to the left.
  const engine::CameraModel camera = StronglyDistorted();
  const double edge = camera.Project({0.15, 0, 1})->x() - 2;
  video_ = cv::Mat(camera.height_px(), camera.width_px(), CV_8UC3, cv::Scalar::all(30));
  video_(cv::Rect(static_cast<int>(std::ceil(edge)), 0, camera.width_px() - static_cast<int>(std::ceil(edge)),
                  camera.height_px())) = cv::Scalar::all(120);
  const cv::Mat image = Draw(1.5, Screen(0.15F, 9, 1));
  const int row = static_cast<int>(std::lround(camera.Project({0.15, 0, 1})->y()));
  int visible = 0;
  for (int x = 0; x < image.cols; ++x) {
    if (image.at<cv::Vec3b>(row, x)[1] > 190) visible = x;
  }
  EXPECT_NEAR(visible + 0.5, edge, 1.0);
}

TEST_F(SurfaceDrawerTest, MakesEdgesSoftInAPlainImage) {
  const cv::Mat image = Draw(1.5, Screen(0.15F, 9, 1));
  const int row = image.rows / 2;
  int between = 0;
  for (int x = 0; x < image.cols; ++x) {
    const int green = image.at<cv::Vec3b>(row, x)[1];
    between += green > 20 && green < 235;
  }
  EXPECT_GE(between, 2);
  EXPECT_LE(between, 7) << "the radius of the filter to both sides";
}

TEST_F(SurfaceDrawerTest, HidesContentThatIsSeenThrough) {
  alpha_ = 0.5F;
  ASSERT_GT(cv::mean(Draw(2, nullptr))[1], 5);
  EXPECT_EQ(cv::mean(Draw(2, Screen(-9, 9, 1)))[1], 0);
}

TEST_F(SurfaceDrawerTest, WorksInEveryFaceOfAFisheyeLens) {
  const engine::CameraModel camera(engine::LensModel::kKannalaBrandt, {480, 480, 140, 140, 240, 240}, {});
  ASSERT_GT(Green(Draw(0.3, nullptr, camera)), 10'000) << "the square must reach beyond one face";
  EXPECT_EQ(Green(Draw(0.3, Screen(-9, 9, 0.2F), camera)), 0);
}

TEST_F(SurfaceDrawerTest, ShowsContentAtTheRimOfALensThatDoesNotFillTheImage) {
  // This lens is one-to-one up to 46 degrees, which are seen 281 pixels from the middle.
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, {640, 480, 400, 400, 319.5, 239.5},
                                   {-0.3, 0, 0, 0, 0});
  const cv::Mat alone = Draw(0.45, nullptr, camera);
  ASSERT_GT(alone.at<cv::Vec3b>(240, 319 - 278)[1], 127) << "the square must reach the rim";
  EXPECT_EQ(cv::norm(alone, Draw(0.45, Screen(-9, 9, 3), camera), cv::NORM_INF), 0)
      << "the surface is behind";
}

TEST_F(SurfaceDrawerTest, OccludersHideWhatIsBehindThemUnlessTheyAreSwitchedOff) {
  const int all = Green(Draw(2, nullptr));
  occluders_ = {PlacedScreen(-9, 0, 1.95)};
  EXPECT_NEAR(Green(Draw(2, nullptr)), 0.5 * all, 0.01 * all);
  occluders_[0].hidden = true;
  EXPECT_EQ(Green(Draw(2, nullptr)), all);
  occluders_[0].hidden = false;
  occluders_count_ = false;
  EXPECT_EQ(Green(Draw(2, nullptr)), all);
}

TEST_F(SurfaceDrawerTest, OccludersReplaceTheSurfacesThatTheyStandFor) {
  const int all = Green(Draw(2, nullptr));
  // The map has a wall that is too near, before the content; the author says that it is behind.
  occluders_ = {PlacedScreen(-9, 9, 2.1)};
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 1.9F))), all);
  // A surface far from the occluder still hides.
  EXPECT_NEAR(Green(Draw(2, Screen(-9, 0, 0.5F))), 0.5 * all, 0.01 * all);
  occluders_.clear();
  EXPECT_EQ(Green(Draw(2, Screen(-9, 9, 1.9F))), 0) << "the surface counts again";
}

TEST_F(SurfaceDrawerTest, OnlyAuthorsSeeAnOccluder) {
  occluders_ = {PlacedScreen(-9, 9, 3)};
  const cv::Mat visitor = Draw(2, nullptr);
  occluders_count_ = false;
  EXPECT_EQ(cv::norm(visitor, Draw(2, nullptr), cv::NORM_INF), 0);
  markers_ = true;
  EXPECT_GT(cv::norm(visitor, Draw(2, nullptr), cv::NORM_INF), 50);
}

}  // namespace
}  // namespace docent::ui
