// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/surface_renderer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/base/random.h"

namespace docent::app {
namespace {

engine::CameraModel::Intrinsics Intrinsics(double focal) {
  return {640, 480, focal, focal * 1.003, 321.3, 238.1};
}

std::vector<engine::CameraModel> Lenses() {
  return {
      engine::CameraModel(engine::LensModel::kRadialTangential, Intrinsics(420), {}), SimulatedCamera(),
      engine::CameraModel(engine::LensModel::kRadialTangential, Intrinsics(380),
                          {-0.28, 0.09, 0.001, -0.0007, -0.01}),
      engine::CameraModel(engine::LensModel::kFov, Intrinsics(360), {0.9, 0, 0, 0, 0}),
      engine::CameraModel(engine::LensModel::kKannalaBrandt, Intrinsics(300), {0.02, -0.005, 0.001, 0, 0})};
}

engine::Rigid3 ObliquePose() {
  return {engine::Rotation3::Exp({0.12, -0.3, 0.2}), Eigen::Vector3d(0.1, -0.05, 1.9)};
}

// Small bright squares on a dark wall, at known world positions.
struct MarkedWall {
  Surfaces surfaces;
  std::vector<Eigen::Vector3d> markers;
};

MarkedWall MakeMarkedWall() {
  constexpr double kWidth = 4, kHeight = 3;
  constexpr int kTexels = 1024, kHalfMarker = 8;
  MarkedWall wall;
  cv::Mat image(kTexels, kTexels, CV_8UC3, cv::Scalar::all(10));
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 12; ++column) {
      const int x = 40 + 80 * column, y = 40 + 80 * row;
      image(cv::Rect(x - kHalfMarker, y - kHalfMarker, 2 * kHalfMarker, 2 * kHalfMarker))
          .setTo(cv::Scalar::all(240));
      wall.markers.push_back(
          {kWidth * (x / double{kTexels} - 0.5), kHeight * (y / double{kTexels} - 0.5), 0});
    }
  }
  wall.surfaces.AddRectangle({-kWidth / 2, -kHeight / 2, 0}, {kWidth, 0, 0}, {0, kHeight, 0},
                             wall.surfaces.AddTexture(image));
  return wall;
}

// The centroid of the brightness around a pixel.
Eigen::Vector2d Centroid(const cv::Mat& image, const Eigen::Vector2d& about, int reach) {
  double sum = 0;
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  const int x0 = static_cast<int>(std::lround(about.x())), y0 = static_cast<int>(std::lround(about.y()));
  for (int y = y0 - reach; y <= y0 + reach; ++y) {
    for (int x = x0 - reach; x <= x0 + reach; ++x) {
      const double brightness = image.at<cv::Vec3b>(y, x)[1] - 10;
      sum += brightness;
      weighted += brightness * Eigen::Vector2d(x, y);
    }
  }
  return weighted / sum;
}

TEST(SurfaceRenderer, DrawsMarkersWithinATenthOfAPixelForEveryLens) {
  const MarkedWall wall = MakeMarkedWall();
  for (const engine::CameraModel& camera : Lenses()) {
    const SurfaceRenderer renderer(&wall.surfaces, camera);
    const engine::Rigid3 camera_from_world = ObliquePose();
    cv::Mat image;
    renderer.Render(camera_from_world, &image);
    int checked = 0;
    double worst = 0;
    for (const Eigen::Vector3d& marker : wall.markers) {
      const auto pixel = camera.Project(camera_from_world * marker);
      if (!pixel || !camera.IsInside(*pixel, 16)) continue;
      // The centroid of an obliquely seen square is not the projection of its centre, so the expected value
      // is the mean of the projections of many of its points, weighted by their image area to first order.
      double area = 0, reach = 0;
      Eigen::Vector2d expected = Eigen::Vector2d::Zero();
      constexpr int kGrid = 9;
      for (int i = 0; i < kGrid * kGrid; ++i) {
        const Eigen::Vector3d spot =
            marker + Eigen::Vector3d(4.0 * 16 / 1024 * ((i % kGrid + 0.5) / kGrid - 0.5),
                                     3.0 * 16 / 1024 * ((i / kGrid + 0.5) / kGrid - 0.5), 0);
        Eigen::Vector2d projected;
        Eigen::Matrix<double, 2, 3> jacobian;
        ASSERT_TRUE(camera.Project(camera_from_world * spot, &projected, &jacobian));
        const double density =
            std::abs((jacobian * camera_from_world.rotation.matrix().leftCols<2>()).determinant());
        area += density;
        reach = std::max(reach, (projected - *pixel).cwiseAbs().maxCoeff());
        expected += density * projected;
      }
      expected /= area;
      worst = std::max(worst, (Centroid(image, *pixel, static_cast<int>(reach) + 3) - expected).norm());
      ++checked;
    }
    EXPECT_GT(checked, 40) << camera;
    EXPECT_LT(worst, 0.08) << "pixels, " << camera;
  }
}

// The rectangle lists of the image tiles must be complete: the image must equal that of exhaustive ray
// casting.
TEST(SurfaceRenderer, MatchesExhaustiveRayCasting) {
  Random random(5);
  Surfaces surfaces;
  std::vector<cv::Vec3b> colors;
  for (int i = 0; i < 150; ++i) {
    const cv::Vec3b color(static_cast<uchar>(random.Below(200) + 30),
                          static_cast<uchar>(random.Below(200) + 30),
                          static_cast<uchar>(random.Below(200) + 30));
    colors.push_back(color);
    const int texture = surfaces.AddTexture(cv::Mat(4, 4, CV_8UC3, cv::Scalar(color)));
    const engine::Rotation3 turn =
        engine::Rotation3::Exp({random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2)});
    // The rectangles surround the camera, so that some extend behind it.
    const Eigen::Vector3d corner(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3));
    surfaces.AddRectangle(corner, turn * Eigen::Vector3d(random.Uniform(0.05, 1.2), 0, 0),
                          turn * Eigen::Vector3d(0, random.Uniform(0.05, 1.2), 0), texture);
  }
  for (const engine::CameraModel& camera : Lenses()) {
    const engine::Rigid3 world_from_camera = ObliquePose().inverse();
    cv::Mat image;
    SurfaceRenderer(&surfaces, camera).Render(world_from_camera.inverse(), &image);
    int compared = 0, wrong = 0, empty = 0;
    for (int y = 2; y < 478; y += 3) {
      for (int x = 2; x < 638; x += 3) {
        // Compare only where the neighbourhood shows a single rectangle; elsewhere the image is blended.
        std::array<int, 5> seen{};
        const std::array<Eigen::Vector2d, 5> offsets = {Eigen::Vector2d(0, 0), Eigen::Vector2d(-1, 0),
                                                        Eigen::Vector2d(1, 0), Eigen::Vector2d(0, -1),
                                                        Eigen::Vector2d(0, 1)};
        bool has_rays = true;
        for (std::size_t i = 0; i < seen.size(); ++i) {
          const auto ray = camera.Unproject(Eigen::Vector2d(x, y) + offsets[i]);
          has_rays = has_rays && ray;
          if (!ray) continue;
          const auto hit =
              surfaces.Intersect(world_from_camera.translation, world_from_camera.rotation * *ray);
          seen[i] = hit ? hit->rectangle : -1;
        }
        if (!has_rays || std::count(seen.begin(), seen.end(), seen[0]) != 5) continue;
        const cv::Vec3b expected = seen[0] < 0 ? cv::Vec3b() : colors[static_cast<std::size_t>(seen[0])];
        ++compared;
        empty += seen[0] < 0 ? 1 : 0;
        wrong += cv::norm(image.at<cv::Vec3b>(y, x), expected, cv::NORM_INF) > 1 ? 1 : 0;
      }
    }
    EXPECT_GT(compared, 20000) << camera;
    EXPECT_LT(empty, compared) << camera;
    EXPECT_EQ(wrong, 0) << "of " << compared << ", " << camera;
  }
}

TEST(SurfaceRenderer, IsBlackWhereThereIsNoSurface) {
  const Surfaces nothing;
  cv::Mat image;
  SurfaceRenderer(&nothing, SimulatedCamera(160)).Render({}, &image);
  EXPECT_EQ(image.size(), cv::Size(160, 120));
  EXPECT_EQ(cv::norm(image, cv::NORM_INF), 0);
}

TEST(SurfaceRenderer, AveragesFineTextureFarAway) {
  // A wall with a fine checkerboard pattern must appear grey from far away, not black and white.
  cv::Mat squares(256, 256, CV_8UC3);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x)
      squares.at<cv::Vec3b>(y, x) = (x + y) % 2 == 0 ? cv::Vec3b() : cv::Vec3b(255, 255, 255);
  }
  Surfaces surfaces;
  surfaces.AddRectangle({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, surfaces.AddTexture(squares));
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, Intrinsics(300), {});
  cv::Mat image;
  SurfaceRenderer(&surfaces, camera).Render({engine::Rotation3(), Eigen::Vector3d(0, 0, 12)}, &image);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image(cv::Rect(300, 220, 40, 40)), mean, deviation);
  EXPECT_NEAR(mean[0], 127.5, 2);
  EXPECT_LT(deviation[0], 4);
}

}  // namespace
}  // namespace docent::app
