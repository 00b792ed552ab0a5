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

constexpr double kBayPitch = 3.6;  // Metres along the hall.
constexpr double kHalfNave = 3.1;  // Metres from the middle of the hall to a bay's wall.
constexpr double kCabinetHeight = 0.95, kCabinetWidth = 1.7, kCabinetDepth = 0.65;

// Textures that all bays share, so that they look alike.
struct BayTextures {
  int column, cabinet_front, cabinet_body, plinth;
};

Stand BayStand(int bay, int bays) {
  const int right_bays = (bays + 1) / 2;
  Stand stand;
  // The bays are numbered forward along the right side and back along the left side.
  const bool is_right = bay < right_bays;
  const int row = is_right ? bay : bays - 1 - bay;
  stand.origin = {0, 0, kBayPitch * row};
  stand.yaw_rad = is_right ? std::numbers::pi / 2 : -std::numbers::pi / 2;
  return stand;
}

void FurnishBay(const Stand& stand, const BayTextures& shared, std::uint64_t seed, Scene* scene) {
  Random random(seed);
  Surfaces& surfaces = scene->surfaces;
  const double cabinet_z = kHalfNave - 0.25 - kCabinetDepth / 2;
  surfaces.AddBox(stand.Point({0, 0, cabinet_z}), kCabinetWidth, kCabinetHeight, kCabinetDepth, stand.yaw_rad,
                  shared.cabinet_body, shared.cabinet_front);
  AddClutter(stand, {0, -kCabinetHeight, cabinet_z}, kCabinetWidth - 0.1, kCabinetDepth - 0.06, 6, 0.45,
             &random, scene);
  // Two rows of paintings and posters, at different positions in each bay.
  double left = -1.5 + random.Uniform(0, 0.15);
  while (left < 0.95) {
    const double width = random.Uniform(0.5, 0.95), height = random.Uniform(0.55, 0.95);
    const Eigen::Vector3d center(left + width / 2, -(1.95 + random.Uniform(-0.12, 0.2)), kHalfNave - 0.03);
    const std::uint64_t painting_seed = random.Next();
    const int texture = surfaces.AddTexture(random.Below(3) == 0 ? PaintPoster({512, 512}, painting_seed)
                                                                 : PaintPainting({512, 512}, painting_seed));
    HangPainting(stand, center, width, height, texture, scene);
    left += width + random.Uniform(0.06, 0.25);
  }
  const int label = surfaces.AddTexture(PaintPage({256, 256}, random.Next()));
  HangPainting(stand, {random.Uniform(-1.3, 1.3), -random.Uniform(1.05, 1.25), kHalfNave - 0.02}, 0.3, 0.36,
               label, scene);
  // An exhibit on a plinth, at one side and closer to the visitor.
  const double side = random.Below(2) == 0 ? -1.25 : 1.25;
  const Eigen::Vector3d foot(side, 0, kHalfNave - 0.75 + random.Uniform(-0.15, 0.15));
  const double plinth_height = random.Uniform(0.6, 0.85);
  surfaces.AddBox(stand.Point(foot), 0.36, plinth_height, 0.36, stand.yaw_rad, shared.plinth);
  const int exhibit = surfaces.AddTexture(PaintCollage({512, 256}, random.Next()));
  double base = -plinth_height;
  for (int part = 0; part < 3; ++part) {
    const double height = random.Uniform(0.12, 0.26);
    surfaces.AddColumn(stand.Point({foot.x(), base, foot.z()}), random.Uniform(0.07, 0.16), height, 12,
                       exhibit, {0, part / 3.0, 1, (part + 1) / 3.0});
    base -= height;
  }
}

}  // namespace

Scene BuildMuseum(const SceneRequest& request) {
  Random random(request.seed);
  Scene scene;
  scene.trajectory = Trajectory(random.Next());
  Surfaces& surfaces = scene.surfaces;
  const int bays = request.parameter, rows = (bays + 1) / 2;
  Hall hall;
  hall.low = {-kHalfNave, 0, -kBayPitch / 2 - 1};
  hall.high = {kHalfNave, 3.6, kBayPitch * (rows - 0.5) + 1};
  hall.floor = surfaces.AddTexture(PaintTiles({1024, 1024}, 8, random.Next()), true);
  hall.walls = surfaces.AddTexture(PaintPlaster({1024, 1024}, {150, 158, 162}, random.Next()), true);
  hall.ceiling = surfaces.AddTexture(PaintBricks({512, 512}, {120, 130, 140}, 8, random.Next()), true);
  hall.floor_pitch = 2.4;
  AddHall(hall, &scene);
  const BayTextures shared = {
      surfaces.AddTexture(PaintStone({512, 1024}, {135, 140, 145}, random.Next())),
      surfaces.AddTexture(PaintCabinet({1024, 512}, {55, 85, 125}, random.Next())),
      surfaces.AddTexture(PaintWood({512, 512}, {50, 80, 115}, 6, random.Next())),
      surfaces.AddTexture(PaintStone({512, 256}, {165, 170, 175}, random.Next())),
  };
  const std::uint64_t first_seed = random.Next();
  std::vector<Stand> stands;
  for (int bay = 0; bay < bays; ++bay) {
    stands.push_back(BayStand(bay, bays));
    const std::uint64_t own_seed = bay == 0 ? first_seed : random.Next();
    FurnishBay(stands.back(), shared, request.identical_places ? first_seed : own_seed, &scene);
    scene.places.push_back({std::to_string(bay), stands.back().Point({0, -kCabinetHeight, kHalfNave - 0.6})});
  }
  for (int row = 0; row <= rows; ++row) {
    for (const double side : {-1.0, 1.0}) {
      surfaces.AddColumn({side * (kHalfNave - 0.3), 0, kBayPitch * (row - 0.5)}, 0.2, 3.6, 14, shared.column);
    }
  }
  // A large painting at each end of the hall.
  for (const double yaw : {0.0, std::numbers::pi}) {
    Stand end;
    end.yaw_rad = yaw;
    end.origin = {0, 0, yaw == 0 ? hall.high.z() : hall.low.z()};
    HangPainting(end, {0, -1.8, -0.02}, 2.6, 2.0,
                 surfaces.AddTexture(PaintPainting({512, 512}, random.Next())), &scene);
  }
  TourPlaces(stands, Viewing{}, request, &random, &scene);
  return scene;
}

}  // namespace docent::app
