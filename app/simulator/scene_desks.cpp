// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "app/simulator/paint.h"
#include "app/simulator/paint_basics.h"
#include "app/simulator/scene.h"
#include "app/simulator/scene_parts.h"

namespace docent::app {
namespace {

constexpr double kDeskPitch = 2.1;                                        // Metres along the row.
constexpr double kDeskWidth = 1.6, kDeskDepth = 0.8, kDeskHeight = 0.74;  // Metres.
constexpr double kDeskMiddle = 1.25, kPartition = 1.7;  // Distances in front of the visitor, metres.

struct DeskTextures {
  int top, body, partition, bezel, keyboard;
};

void FurnishDesk(const Stand& stand, const DeskTextures& shared, std::uint64_t seed, Scene* scene) {
  Random random(seed);
  Surfaces& surfaces = scene->surfaces;
  const double front = kDeskMiddle - kDeskDepth / 2;
  surfaces.AddBox(stand.Point({0, -kDeskHeight + 0.05, kDeskMiddle}), kDeskWidth, 0.04, kDeskDepth, 0,
                  shared.body);
  surfaces.AddRectangle(stand.Point({-kDeskWidth / 2, -kDeskHeight, front + kDeskDepth}), {kDeskWidth, 0, 0},
                        {0, 0, -kDeskDepth}, shared.top);
  for (const double x : {-1.0, 1.0}) {
    surfaces.AddBox(stand.Point({x * (kDeskWidth / 2 - 0.04), 0, kDeskMiddle}), 0.06, kDeskHeight - 0.05, 0.7,
                    0, shared.body);
  }
  surfaces.AddBox(stand.Point({0, 0, kPartition}), kDeskPitch - 0.05, 1.35, 0.04, 0, shared.partition,
                  shared.partition);
  // All desks have the same monitor with different content on the screen.
  const int screen = surfaces.AddTexture(PaintScreen({512, 256}, random.Next()));
  const double monitor_x = random.Uniform(-0.12, 0.12), monitor_yaw = random.Uniform(-0.2, 0.2);
  surfaces.AddBox(stand.Point({monitor_x, -kDeskHeight, kDeskMiddle + 0.22}), 0.12, 0.12, 0.1, 0,
                  shared.bezel);
  surfaces.AddBox(stand.Point({monitor_x, -kDeskHeight - 0.1, kDeskMiddle + 0.18}), 0.56, 0.34, 0.04,
                  monitor_yaw, shared.bezel, screen);
  surfaces.AddBox(stand.Point({monitor_x, -kDeskHeight, kDeskMiddle - 0.18}), 0.42, 0.025, 0.15, 0,
                  shared.keyboard);
  for (const double x : {-0.54, 0.54}) {
    AddClutter(stand, {x, -kDeskHeight, kDeskMiddle}, 0.46, 0.72, 5, 0.27, &random, scene);
  }
  const int page = surfaces.AddTexture(PaintPage({256, 256}, random.Next()));
  surfaces.AddRectangle(
      stand.Point({monitor_x + random.Uniform(-0.16, 0), -kDeskHeight - 0.002, front + 0.17}), {0.21, 0, 0},
      {0, 0, -0.15}, page);
  for (double left = -0.95 + random.Uniform(0, 0.2); left < 0.7;) {
    const double width = random.Uniform(0.16, 0.34), height = random.Uniform(0.2, 0.36);
    const std::uint64_t note_seed = random.Next();
    const std::uint32_t kind = random.Below(3);
    const int note = surfaces.AddTexture(kind == 0   ? PaintPage({256, 256}, note_seed)
                                         : kind == 1 ? PaintPoster({256, 256}, note_seed)
                                                     : PaintCollage({256, 256}, note_seed));
    HangPainting(stand, {left + width / 2, -random.Uniform(0.98, 1.14), kPartition - 0.025}, width, height,
                 note, scene);
    left += width + random.Uniform(0.03, 0.3);
  }
}

}  // namespace

Scene BuildDesks(const SceneRequest& request) {
  Random random(request.seed);
  Scene scene;
  scene.trajectory = Trajectory(random.Next());
  Surfaces& surfaces = scene.surfaces;
  const int desks = request.parameter;
  Hall hall;
  hall.low = {-2.2, 0, -1.6};
  hall.high = {kDeskPitch * (desks - 1) + 2.2, 2.7, 3.6};
  hall.floor = surfaces.AddTexture(PaintCarpet({512, 512}, random.Next()), true);
  hall.walls = surfaces.AddTexture(PaintPlaster({1024, 1024}, {170, 178, 180}, random.Next()), true);
  hall.ceiling = surfaces.AddTexture(PaintTiles({512, 512}, 4, random.Next()), true);
  AddHall(hall, &scene);
  const DeskTextures shared = {
      surfaces.AddTexture(PaintWood({1024, 512}, {120, 160, 190}, 4, random.Next())),
      surfaces.AddTexture(PaintPlaster({256, 256}, {110, 112, 115}, random.Next())),
      surfaces.AddTexture(PaintPlaster({512, 512}, {135, 110, 85}, random.Next())),
      surfaces.AddTexture(PaintPlaster({128, 128}, {45, 45, 45}, random.Next())),
      surfaces.AddTexture(PaintTiles({512, 256}, 24, random.Next())),
  };
  const std::uint64_t first_seed = random.Next();
  std::vector<Stand> stands;
  for (int desk = 0; desk < desks; ++desk) {
    Stand& stand = stands.emplace_back();
    stand.origin = {kDeskPitch * desk, 0, 0};
    const std::uint64_t own_seed = desk == 0 ? first_seed : random.Next();
    FurnishDesk(stand, shared, request.identical_places ? first_seed : own_seed, &scene);
    scene.places.push_back({std::to_string(desk), stand.Point({0, -kDeskHeight, kDeskMiddle})});
    // A painting on the wall behind the partitions.
    const double width = random.Uniform(0.8, 1.3);
    Stand wall;
    wall.origin = {kDeskPitch * desk, 0, hall.high.z()};
    const int image = surfaces.AddTexture(PaintPainting({512, 512}, random.Next()));
    HangPainting(wall, {random.Uniform(-0.4, 0.4), -1.85, -0.02}, width, random.Uniform(0.6, 0.9), image,
                 &scene);
  }
  Viewing viewing;
  viewing.eye_height = 1.3;
  viewing.nearest = 0.3;
  viewing.farthest = -0.15;
  viewing.target_ahead = kDeskMiddle + 0.1;
  viewing.target_height = 0.86;
  viewing.swing = 0.38;
  TourPlaces(stands, viewing, request, &random, &scene);
  return scene;
}

}  // namespace docent::app
