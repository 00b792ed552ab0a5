// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <string>

#include "app/simulator/paint.h"
#include "app/simulator/paint_basics.h"
#include "app/simulator/scene.h"
#include "app/simulator/scene_parts.h"

namespace docent::app {
namespace {

constexpr double kHalfWidth = 2.8, kHalfDepth = 2.5, kHeight = 2.6;           // Of the room, metres.
constexpr double kTableWidth = 1.5, kTableDepth = 0.95, kTableHeight = 0.75;  // Metres.

void AddTable(Random* random, Scene* scene) {
  Surfaces& surfaces = scene->surfaces;
  const int top = surfaces.AddTexture(PaintWood({1024, 512}, {75, 115, 160}, 6, random->Next()));
  const int legs = surfaces.AddTexture(PaintWood({256, 256}, {60, 90, 125}, 3, random->Next()));
  const double half_x = kTableWidth / 2, half_z = kTableDepth / 2, board = 0.04;
  surfaces.AddRectangle({-half_x, -kTableHeight, half_z}, {kTableWidth, 0, 0}, {0, 0, -kTableDepth}, top);
  surfaces.AddBox({0, -kTableHeight + board + 0.001, 0}, kTableWidth, board, kTableDepth, 0, legs);
  for (const double x : {-1.0, 1.0}) {
    for (const double z : {-1.0, 1.0}) {
      surfaces.AddBox({x * (half_x - 0.06), 0, z * (half_z - 0.06)}, 0.07, kTableHeight - board, 0.07, 0,
                      legs);
    }
  }
  AddClutter({}, {0, -kTableHeight, 0}, kTableWidth - 0.05, kTableDepth - 0.05, 11, 0.32, random, scene);
  for (int page = 0; page < 3; ++page) {
    const Eigen::Vector3d middle(random->Uniform(-0.55, 0.55), -kTableHeight - 0.001 * (page + 1),
                                 random->Uniform(-0.25, 0.25));
    const double yaw = random->Uniform(0, kTau);
    const Eigen::Vector3d right(0.21 * std::cos(yaw), 0, 0.21 * std::sin(yaw));
    const Eigen::Vector3d down(0.297 * std::sin(yaw), 0, -0.297 * std::cos(yaw));
    surfaces.AddRectangle(middle - right / 2 - down / 2, right, down,
                          surfaces.AddTexture(PaintPage({256, 256}, random->Next())));
  }
}

// Posters and paintings along one wall, between the furniture.
void DecorateWall(const Stand& wall, double length, Random* random, Scene* scene) {
  double left = -length / 2 + random->Uniform(0.1, 0.3);
  while (left < length / 2 - 0.8) {
    const double width = random->Uniform(0.5, 0.95), height = random->Uniform(0.6, 1.0);
    const std::uint64_t seed = random->Next();
    const int texture = scene->surfaces.AddTexture(random->Below(2) == 0 ? PaintPoster({512, 512}, seed)
                                                                         : PaintPainting({512, 512}, seed));
    HangPainting(wall, {left + width / 2, -random->Uniform(1.35, 1.75), -0.02}, width, height, texture,
                 scene);
    left += width + random->Uniform(0.1, 0.4);
  }
}

void Furnish(Random* random, Scene* scene) {
  Surfaces& surfaces = scene->surfaces;
  Hall hall;
  hall.low = {-kHalfWidth, 0, -kHalfDepth};
  hall.high = {kHalfWidth, kHeight, kHalfDepth};
  hall.floor = surfaces.AddTexture(PaintWood({1024, 1024}, {90, 125, 155}, 12, random->Next()), true);
  hall.walls = surfaces.AddTexture(PaintPlaster({1024, 1024}, {160, 178, 182}, random->Next()), true);
  hall.ceiling = surfaces.AddTexture(PaintPlaster({512, 512}, {190, 195, 195}, random->Next()), true);
  hall.floor_pitch = 2.8;
  AddHall(hall, scene);
  surfaces.AddRectangle({-1.3, -0.004, 0.95}, {2.6, 0, 0}, {0, 0, -1.9},
                        surfaces.AddTexture(PaintCarpet({1024, 512}, random->Next())));
  const double quarter = kTau / 4;
  for (int wall = 0; wall < 4; ++wall) {
    Stand stand;
    stand.yaw_rad = wall * quarter;
    const double distance = wall % 2 == 0 ? kHalfDepth : kHalfWidth,
                 length = wall % 2 == 0 ? 2 * kHalfWidth : 2 * kHalfDepth;
    stand.origin = stand.Direction({0, 0, distance});
    DecorateWall(stand, length, random, scene);
    // A bookcase, chest or stack of boxes in front of the wall, at one side.
    const double x = random->Uniform(-0.3, 0.3) * length;
    const int body = surfaces.AddTexture(PaintWood({256, 256}, {60, 95, 130}, 4, random->Next()));
    if (wall % 2 == 0) {
      const int books = surfaces.AddTexture(PaintBooks({512, 512}, 3, random->Next()));
      surfaces.AddBox(stand.Point({x, 0, -0.2}), 1.1, 1.15, 0.34, stand.yaw_rad, body, books);
      AddClutter(stand, {x, -1.15, -0.2}, 1.0, 0.32, 3, 0.28, random, scene);
    } else {
      const int front = surfaces.AddTexture(PaintCabinet({512, 256}, {80, 110, 140}, random->Next()));
      surfaces.AddBox(stand.Point({x, 0, -0.25}), 1.2, 0.8, 0.42, stand.yaw_rad, body, front);
      AddClutter(stand, {x, -0.8, -0.25}, 1.1, 0.4, 4, 0.35, random, scene);
    }
  }
}

// Camera position on a periodic path around the table, which rerotations to the same places.
Eigen::Vector3d EyeAt(double time_s) {
  const double angle = -kTau / 4 + 0.95 * std::sin(kTau * time_s / 17);
  const double radius = 1.55 + 0.2 * std::sin(kTau * time_s / 11 + 0.5);
  return {radius * std::cos(angle), -1.42 - 0.17 * std::sin(kTau * time_s / 13), radius * std::sin(angle)};
}

Eigen::Vector3d GazeAt(double time_s) {
  return {0.18 * std::sin(kTau * time_s / 7), -0.85 - 0.06 * std::sin(kTau * time_s / 9),
          0.1 * std::cos(kTau * time_s / 8)};
}

}  // namespace

void FurnishRoom(Random* random, Scene* scene) {
  AddTable(random, scene);
  Furnish(random, scene);
  scene->places.push_back({"table", {0, -kTableHeight, 0}});
}

Scene BuildRoom(const SceneRequest& request) {
  Random random(request.seed);
  Scene scene;
  scene.trajectory = Trajectory(random.Next());
  FurnishRoom(&random, &scene);

  Trajectory& trajectory = scene.trajectory;
  const double step = 0.5,
               stretch = 9;  // Seconds between waypoints, and of motion between two pure rotations.
  const double motion = request.parameter == 0 ? 30 : stretch * (request.parameter + 1);
  trajectory.BeginSegment("general");
  trajectory.LookFrom(EyeAt(0), GazeAt(0), 0);
  int rotations = 0;
  for (int i = 1; i * step <= motion; ++i) {
    trajectory.LookFrom(EyeAt(i * step), GazeAt(i * step), step);
    if (rotations >= request.parameter || i * step < stretch * (rotations + 1)) continue;
    // A pure rotation without sway to one side and back to the table.
    const Eigen::Vector3d spot = trajectory.last_position();
    const double yaw = trajectory.last_yaw_rad(), side = rotations % 2 == 0 ? 1 : -1;
    const double pitch = trajectory.last_pitch_rad();
    trajectory.MoveTo(spot, yaw, pitch, 0.4, 0);
    trajectory.BeginSegment("rotation");
    trajectory.MoveTo(spot, yaw + side * 1.0, 0.4 * pitch, 1.6, 0);
    trajectory.MoveTo(spot, yaw + side * 2.1, 0, 1.6, 0);
    trajectory.MoveTo(spot, yaw + side * 1.0, 0.5 * pitch, 1.6, 0);
    trajectory.MoveTo(spot, yaw, pitch, 1.6, 0);
    trajectory.BeginSegment("general");
    ++rotations;
  }
  return scene;
}

}  // namespace docent::app
