// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "app/simulator/scene.h"
#include "engine/base/random.h"

// Parts that several scenes share: local frames, clutter on a surface, the walls of a hall, and the tour of
// places.
namespace docent::app {

inline constexpr double kTau = 2 * std::numbers::pi;

// An upright frame in the world: x right, y down, z ahead for a person who stands at its origin.
struct Stand {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double yaw_rad = 0;

  Eigen::Vector3d Direction(const Eigen::Vector3d& direction) const;
  Eigen::Vector3d Point(const Eigen::Vector3d& point) const { return origin + Direction(point); }
};

// Adds an upright image that faces the origin of the stand; `center` is in the stand's frame.
void HangPainting(const Stand& stand, const Eigen::Vector3d& center, double width, double height, int texture,
                  Scene* scene);
// Adds boxes, vases and books at random positions in a rectangle of width by depth around `center` (in the
// stand's frame, on the surface), without overlap. Each object has its own texture.
void AddClutter(const Stand& stand, const Eigen::Vector3d& center, double width, double depth, int count,
                double tallest, Random* random, Scene* scene);
// Floor, ceiling and four walls of the box from `low` to `high` (floor at y = 0). The floor's texture repeats
// every floor_pitch metres, that of the walls every wall_pitch metres.
struct Hall {
  Eigen::Vector3d low, high;
  int floor = 0, walls = 0, ceiling = 0;
  double floor_pitch = 2, wall_pitch = 3;
};
void AddHall(const Hall& hall, Scene* scene);

// Builds the furnished room with a table full of objects in its middle (see BuildRoom).
void FurnishRoom(Random* random, Scene* scene);

// How the camera views a place, in the place's stand and in metres: height of the camera above the floor,
// smallest distance, and distance and height of the target.
struct Viewing {
  double eye_height = 1.55, nearest = 0.9, farthest = 0.4, target_ahead = 2.9, target_height = 1.2,
         swing = 0.45;
};
// Adds a trajectory that builds the places one after another and then visits them in another order: `buildK`,
// `travel`, `visitK`. A build takes six seconds and moves sideways by at least 0.35 m within the first two.
// With a `walk`, which is the seed of another visitor, all up to the last step of the last build stays the
// same, and the visits have another order, other viewpoints and other durations; so have all rounds but the
// first. A longer build goes on in the same way, from one random viewpoint to the next.
void TourPlaces(const std::vector<Stand>& stands, const Viewing& viewing, const SceneRequest& request,
                Random* random, Scene* scene);

}  // namespace docent::app
