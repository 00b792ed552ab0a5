// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "tests/ui/ui_testing.h"
#include "ui/lens_warp.h"

namespace docent::ui {
namespace {

using engine::CameraModel;
using engine::LensModel;

// Draws a small square around the 3D point that each chosen pixel sees and measures where the square appears.
void ExpectContentAppearsWhereTheLensProjects(const CameraModel& camera) {
  Renderer renderer;
  const engine::TrackedFrame tracked =
      Tracked(cv::Mat::zeros(camera.height_px(), camera.width_px(), CV_8UC3));
  int checked = 0;
  double worst = 0;
  for (double y = 20.3; y < camera.height_px() - 12; y += 0.23 * camera.height_px()) {
    for (double x = 20.7; x < camera.width_px() - 12; x += 0.19 * camera.width_px()) {
      const std::optional<Eigen::Vector3d> ray = camera.Unproject({x, y});
      if (!ray) continue;
      const Eigen::Vector3d point = 2.5 * *ray;
      content::Scene scene;
      const auto side = static_cast<float>(5 * 2.5 * camera.PixelAngle());
      scene.entities.push_back(Facing(SquareModel(side, glm::vec4(1)), point));
      const Eigen::Vector2d seen = Centroid(DrawImage(&renderer, tracked, camera, scene));
      const std::optional<Eigen::Vector2d> expected = camera.Project(point);
      ASSERT_TRUE(expected.has_value());
      EXPECT_LT((seen - *expected).norm(), 0.25)
          << "at " << expected->transpose() << " seen " << seen.transpose();
      worst = std::max(worst, (seen - *expected).norm());
      ++checked;
    }
  }
  EXPECT_GT(checked, 15);
  ::testing::Test::RecordProperty("worst_px", std::to_string(worst));
}

using Lens = OffscreenTest;

TEST_F(Lens, DrawsContentWhereAStronglyDistortedLensProjectsIt) {
  ExpectContentAppearsWhereTheLensProjects(StronglyDistorted());
}

TEST_F(Lens, DrawsContentWhereAFieldOfViewLensProjectsIt) {
  ExpectContentAppearsWhereTheLensProjects(
      {LensModel::kFov, {640, 480, 300.0, 302.0, 322.0, 238.0}, {0.92, 0, 0, 0, 0}});
}

TEST_F(Lens, DrawsContentBesideAndBehindTheCameraOfAFisheyeLens) {
  // The rays of the image's corners are 115 degrees off the axis.
  ExpectContentAppearsWhereTheLensProjects(
      {LensModel::kKannalaBrandt, {640, 480, 200.0, 200.0, 319.0, 240.0}, {0.01, -0.002, 0, 0, 0}});
}

TEST(LensWarp, UsesOneFaceForAnOrdinaryLensAndSeveralForAFisheye) {
  const CameraModel ordinary = StronglyDistorted();
  const LensWarp one = MakeLensWarp(ordinary, 4096);
  ASSERT_EQ(one.faces.size(), 1u);
  // The centre keeps its resolution: the face has as many pixels per unit of tangent as the lens.
  const LensFace& face = one.faces[0];
  EXPECT_GE(face.width_px / (face.bounds.right - face.bounds.left), 0.999 * ordinary.intrinsics().fx);
  const CameraModel fisheye(LensModel::kKannalaBrandt, {640, 480, 200.0, 200.0, 319.0, 240.0}, {});
  EXPECT_GE(MakeLensWarp(fisheye, 4096).faces.size(), 5u);
}

TEST(LensWarp, FitsTheAtlasIntoTheLargestTexture) {
  const CameraModel fisheye(LensModel::kKannalaBrandt, {640, 480, 200.0, 200.0, 319.0, 240.0}, {});
  const LensWarp warp = MakeLensWarp(fisheye, 512);
  EXPECT_LE(std::max(warp.atlas_width_px, warp.atlas_height_px), 512);
}

TEST(LensWarp, MapsEachPixelToTheTexelOfItsRay) {
  const CameraModel camera = StronglyDistorted();
  const LensWarp warp = MakeLensWarp(camera, 4096);
  const LensFace& face = warp.faces[0];
  for (int y = 0; y < 480; y += 37) {
    for (int x = 0; x < 640; x += 41) {
      const glm::vec2 place = warp.lookup[y * 640 + x];
      const Eigen::Vector3d ray(face.bounds.left + place.x * (face.bounds.right - face.bounds.left),
                                face.bounds.bottom - place.y * (face.bounds.bottom - face.bounds.top), 1.0);
      const std::optional<Eigen::Vector2d> pixel = camera.Project(ray);
      ASSERT_TRUE(pixel.has_value());
      EXPECT_LT((*pixel - Eigen::Vector2d(x, y)).norm(), 1e-3);
    }
  }
}

}  // namespace
}  // namespace docent::ui
