// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/simulator/surfaces.h"
#include "app/simulator/trajectory.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::app {

// A point at which content is placed: the centre of a bay's cabinet, of a desk or of the table.
struct SimulatedPlace {
  std::string name;  // As in the labels: the place of "build3" and "visit3" is "3".
  Eigen::Vector3d anchor_in_world = Eigen::Vector3d::Zero();
};

// A world and the camera trajectory through it.
struct Scene {
  Surfaces surfaces;
  Trajectory trajectory{0};
  std::vector<SimulatedPlace> places;
  std::optional<engine::CameraModel> camera;  // The lens that the scene requires, if any.
  engine::Rigid3 carrier_from_camera;  // Mounting of the camera on the carrier that follows the trajectory.
  double sensor_gain = 1;              // Exposure relative to the other cameras of the world.
  std::uint64_t sensor_number = 0;     // Gives each camera of a world its own noise.
};

// Parameters of a scene.
struct SceneRequest {
  int parameter = 0;       // The number after the colon.
  std::uint64_t seed = 1;  // Seed of textures, object positions and hand sway.
  bool identical_places =
      false;  // All places have the content of the first, so they cannot be distinguished.
  // Of `museum` and `desks`: seed of the walk through the places after they were built; 0: the usual walk.
  std::uint64_t walk = 0;
  // Of `museum` and `desks`: time at each place while it is built, seconds, at least the usual six; and how
  // often all places are visited.
  double build_s = 0;
  int rounds = 1;
};

// A named scene with the meaning and range of the number after the colon.
struct SceneRecipe {
  const char* name;
  const char* parameter_meaning;  // One phrase for the list of scenes.
  int default_parameter, lowest_parameter, highest_parameter;
  Scene (*build)(const SceneRequest& request);
};
std::span<const SceneRecipe> SceneRecipes();

// A table with objects in a furnished room; the camera moves back and forth around it (`general`). parameter:
// number of pure rotations away from the table and back (`rotation`).
Scene BuildRoom(const SceneRequest& request);
// A hall with bays along both sides that look alike: `buildK`, `travel`, then `visitK` in another order.
Scene BuildMuseum(const SceneRequest& request);
// A row of desks that look alike, with the same kinds of labels.
Scene BuildDesks(const SceneRequest& request);
// Inside of a textured cylinder of 1 m diameter: 100 frames of a rotation by 90 degrees, looking outwards
// from a circle with a radius of `parameter` centimetres (Pirchheim, Schmalstieg and Reitmayr 2013,
// section 7.3). One label, `rotation`.
Scene BuildCylinder(const SceneRequest& request);
// A lawn with one repeated texture. `general`.
Scene BuildGrass(const SceneRequest& request);
// The views of a person at the room's table with one camera in the hand and one on the shoulder, each with a
// horizontal field of view of 94 degrees. Scenes with the same seed show the same walk. parameter: 0 the
// cameras move independently, 1 they are mounted rigidly as given by WearableRig. `general`.
Scene BuildHand(const SceneRequest& request);
Scene BuildShoulder(const SceneRequest& request);
// The shoulder camera with a pan-tilt head: trajectory and lens of BuildShoulder.
Scene BuildHead(const SceneRequest& request);
// Returns hand_from_shoulder of the rigid pair.
engine::Rigid3 WearableRig();
// A walk once around an obstacle in a hall (`loop`) and a little further (`revisit`). parameter: 0 a block of
// cabinets that the camera looks over, 1 a round tower up to the ceiling, where each place is only seen from
// nearby.
Scene BuildLoop(const SceneRequest& request);

}  // namespace docent::app
