// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "app/simulator/scene.h"
#include "engine/base/random.h"

// What several scenes share: standing spots, clutter on a surface, a hall's walls, and the tour of places.
namespace docent::app {

// An upright frame in the world: x right, y down, z ahead for someone who stands at its origin.
struct Stand {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double yaw_rad = 0;

  Eigen::Vector3d Direction(const Eigen::Vector3d& direction) const;
  Eigen::Vector3d Point(const Eigen::Vector3d& point) const { return origin + Direction(point); }
};

// An image that hangs upright, facing the viewer of the stand; center in the stand's frame.
void HangPicture(const Stand& stand, const Eigen::Vector3d& center, double width, double height, int texture,
                 Scene* scene);
// Boxes, vases, and books at random places of a rectangle width by depth around `center` (in the stand's
// frame, on the surface), none inside another. Every thing has its own texture.
void AddClutter(const Stand& stand, const Eigen::Vector3d& center, double width, double depth, int count,
                double tallest, Random* random, Scene* scene);
// Floor, ceiling, and four walls around the box from `low` to `high` (floor at y = 0). The floor's texture
// repeats every floor_pitch metres, the walls' every wall_pitch.
struct Hall {
  Eigen::Vector3d low, high;
  int floor = 0, walls = 0, ceiling = 0;
  double floor_pitch = 2, wall_pitch = 3;
};
void AddHall(const Hall& hall, Scene* scene);

// The furnished room with a table full of things in its middle (see BuildRoom).
void FurnishRoom(Random* random, Scene* scene);

// How the camera looks at a place, in the place's stand: camera height above the floor, the nearest it comes,
// how far ahead the middle of what it looks at lies, and at what height.
struct Viewing {
  double eye_height = 1.55, nearest = 0.9, farthest = 0.4, target_ahead = 2.9, target_height = 1.2,
         swing = 0.45;
};
// Builds the places one after another, then visits them in another order: `buildK`, `travel`, `visitK`. A
// build takes six seconds and starts with 0.35 m to the side or more within two.
void TourPlaces(const std::vector<Stand>& stands, const Viewing& viewing, Random* random, Scene* scene);

}  // namespace docent::app
