// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "app/simulator/paint.h"
#include "app/simulator/paint_basics.h"
#include "app/simulator/scene.h"
#include "app/simulator/scene_parts.h"

namespace docent::app {
namespace {

// A canvas that is tiled with different square images.
cv::Mat Frieze(cv::Size size, int side, Random* random) {
  cv::Mat canvas(size, CV_8UC3);
  const int columns = size.width / side;
  for (int i = 0; i < columns * (size.height / side); ++i) {
    const std::uint64_t seed = random->Next();
    const cv::Size square(side, side);
    const int kind = (i + i / columns) % 4;  // The row below gets a different kind.
    const cv::Mat image = kind == 0   ? PaintCollage(square, seed)
                          : kind == 1 ? PaintPoster(square, seed)
                          : kind == 2 ? PaintPainting(square, seed)
                                      : PaintBooks(square, 3, seed);
    image.copyTo(canvas(cv::Rect(i % columns * side, i / columns * side, side, side)));
  }
  return canvas;
}

// A walk around the origin: camera position and target move on ellipses with these semi-axes along x and z,
// metres.
struct Round {
  int steps = 1, beyond = 0;  // Steps of one round, and of the part that is walked a second time.
  double step_s = 1;
  Eigen::Vector2d eye, gaze;
  double gaze_height = 0;
};
void Walk(const Round& round, Trajectory* trajectory) {
  trajectory->BeginSegment("loop");
  for (int i = 0; i <= round.steps + round.beyond; ++i) {
    const double angle = -kTau / 4 + kTau * i / round.steps;
    const double right = std::cos(angle), ahead = std::sin(angle);
    if (i == round.steps) trajectory->BeginSegment("revisit");
    trajectory->LookFrom({round.eye.x() * right, -1.55, round.eye.y() * ahead},
                         {round.gaze.x() * right, -round.gaze_height, round.gaze.y() * ahead}, round.step_s);
  }
}

// A round wall of flat panels with the texture wrapped once around it. rim(angle) is a point of the upper
// edge.
template <typename Rim>
void AddRoundWall(int panels, const Rim& rim, double height, int texture, Surfaces* surfaces) {
  for (int i = 0; i < panels; ++i) {
    const Eigen::Vector3d a = rim(kTau * i / panels), b = rim(kTau * (i + 1) / panels);
    surfaces->AddRectangle(a, b - a, {0, height, 0}, texture,
                           {static_cast<double>(i) / panels, 0, static_cast<double>(i + 1) / panels, 1});
  }
}

// A block of cabinets with the fronts outwards, and a walk around it.
void BuildCabinets(Random* random, Scene* scene) {
  Surfaces& surfaces = scene->surfaces;
  for (int side = 0; side < 4; ++side) {
    Stand stand;
    stand.yaw_rad = side * kTau / 4;
    const bool is_long = side % 2 == 0;
    for (int i = 0; i < (is_long ? 2 : 1); ++i) {
      const double x = is_long ? -0.7 + 1.4 * i : 0, distance = is_long ? -0.4 : -1.5;
      const int front =
          surfaces.AddTexture(i == 0 ? PaintCabinet({512, 512}, RandomColor(random, 0.4, 0.8), random->Next())
                                     : PaintBooks({512, 512}, 3, random->Next()));
      const int body = surfaces.AddTexture(PaintWood({256, 256}, {70, 100, 135}, 4, random->Next()));
      surfaces.AddBox(stand.Point({x, 0, distance}), 1.38, 1.05, is_long ? 0.78 : 0.2, stand.yaw_rad, body,
                      front);
      if (is_long) AddClutter(stand, {x, -1.05, distance}, 1.3, 0.7, 6, 0.4, random, scene);
    }
  }
  scene->places.push_back({"block", {0, -1.05, 0}});
  Walk({.steps = 60, .beyond = 10, .step_s = 0.5, .eye = {3.1, 2.7}, .gaze = {0.5, 0.1}, .gaze_height = 1.1},
       &scene->trajectory);
}

// A textured round tower up to the ceiling, and a walk around it at a short distance, so that no part is seen
// again before the loop is complete.
void BuildTower(Random* random, Scene* scene) {
  constexpr double kRadius = 2.2, kHeight = 3.2, kWalkRadius = 3.4;
  const int texture = scene->surfaces.AddTexture(Frieze({4096, 1024}, 512, random));
  const auto rim = [](double angle) {
    return Eigen::Vector3d(kRadius * std::cos(angle), -kHeight, kRadius * std::sin(angle));
  };
  AddRoundWall(72, rim, kHeight, texture, &scene->surfaces);
  scene->places.push_back({"tower", {0, -1.5, -kRadius}});
  Walk({.steps = 88,
        .beyond = 14,
        .step_s = 0.3,
        .eye = {kWalkRadius, kWalkRadius},
        .gaze = {0, 0},
        .gaze_height = 1.5},
       &scene->trajectory);
}

}  // namespace

Scene BuildCylinder(const SceneRequest& request) {
  Random random(request.seed);
  Scene scene;
  scene.trajectory = Trajectory(random.Next());
  // Ninety panels deviate by at most 0.3 mm from a cylinder; the ground truth is computed with the panels.
  constexpr double kRadius = 0.5, kHeight = 0.8;
  const int texture = scene.surfaces.AddTexture(Frieze({4096, 1024}, 512, &random));
  const auto rim = [](double angle) {
    return Eigen::Vector3d(kRadius * std::sin(angle), -kHeight / 2, kRadius * std::cos(angle));
  };
  AddRoundWall(90, rim, kHeight, texture, &scene.surfaces);
  scene.places.push_back({"cylinder", {0, 0, kRadius}});
  // A horizontal field of view of 64 degrees without distortion, as in the paper.
  engine::CameraModel::Intrinsics intrinsics{640, 480, 0, 0, 319.5, 239.5};
  intrinsics.fx = intrinsics.fy = 320 / std::tan(kTau * 32 / 360);
  scene.camera = engine::CameraModel(engine::LensModel::kRadialTangential, intrinsics, {});

  const double radius = request.parameter / 100.0;
  constexpr int kFrames = 100;
  scene.trajectory.BeginSegment("rotation");
  for (int frame = 0; frame < kFrames; ++frame) {
    const double yaw = kTau / 4 * frame / (kFrames - 1);
    scene.trajectory.MoveTo({radius * std::sin(yaw), 0, radius * std::cos(yaw)}, yaw, 0, 1 / 30.0, 0);
  }
  return scene;
}

Scene BuildGrass(const SceneRequest& request) {
  Random random(request.seed);
  Scene scene;
  scene.trajectory = Trajectory(random.Next());
  constexpr double kSide = 60, kPitch = 1.5;  // Metres.
  const int lawn = scene.surfaces.AddTexture(PaintGrass({1024, 1024}, random.Next()), true);
  scene.surfaces.AddRectangle({-kSide / 2, 0, kSide / 2}, {kSide, 0, 0}, {0, 0, -kSide}, lawn,
                              {0, 0, kSide / kPitch, kSide / kPitch});
  scene.places.push_back({"lawn", Eigen::Vector3d::Zero()});
  Trajectory& trajectory = scene.trajectory;
  trajectory.BeginSegment("general");
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.5 * i;
    trajectory.LookFrom({1.5 * std::sin(kTau * t / 16), -1.3 - 0.2 * std::sin(kTau * t / 9),
                         -1.0 + 0.3 * std::sin(kTau * t / 12)},
                        {1.2 * std::sin(kTau * t / 16 + 0.2), 0, 0.1}, 0.5);
  }
  return scene;
}

Scene BuildLoop(const SceneRequest& request) {
  Random random(request.seed);
  Scene scene;
  scene.trajectory = Trajectory(random.Next());
  Surfaces& surfaces = scene.surfaces;
  Hall hall;
  hall.low = {-4.6, 0, -4.2};
  hall.high = {4.6, 3.2, 4.2};
  hall.floor = surfaces.AddTexture(PaintTiles({1024, 1024}, 8, random.Next()), true);
  hall.walls = surfaces.AddTexture(PaintBricks({1024, 1024}, {110, 130, 165}, 24, random.Next()), true);
  hall.ceiling = surfaces.AddTexture(PaintPlaster({512, 512}, {180, 185, 185}, random.Next()), true);
  AddHall(hall, &scene);
  for (int wall = 0; wall < 4; ++wall) {
    Stand stand;
    stand.yaw_rad = wall * kTau / 4;
    stand.origin = stand.Direction({0, 0, wall % 2 == 0 ? hall.high.z() : hall.high.x()});
    for (int i = 0; i < 4; ++i) {
      const int image = surfaces.AddTexture(i % 2 == 0 ? PaintPainting({512, 512}, random.Next())
                                                       : PaintPoster({512, 512}, random.Next()));
      HangPainting(stand, {-3.0 + 2 * i + random.Uniform(-0.2, 0.2), -1.7, -0.02}, random.Uniform(0.9, 1.4),
                   random.Uniform(0.8, 1.2), image, &scene);
    }
  }
  if (request.parameter == 0) {
    BuildCabinets(&random, &scene);
  } else {
    BuildTower(&random, &scene);
  }
  return scene;
}

}  // namespace docent::app
