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

// A spot worth a signpost: the middle of a bay's cabinet, of a desk, of the table.
struct SimulatedPlace {
  std::string name;  // as in the labels: the place of "build3" and "visit3" is "3"
  Eigen::Vector3d anchor_in_world = Eigen::Vector3d::Zero();
};

// A world and the way through it.
struct Scene {
  Surfaces surfaces;
  Trajectory trajectory{0};
  std::vector<SimulatedPlace> places;
  std::optional<engine::CameraModel> camera;  // the lens that the scene asks for, if any
  engine::Rigid3 carrier_from_camera;         // how the camera sits on what follows the trajectory
  double sensor_gain = 1;                     // of its exposure, against the other cameras of the world
  std::uint64_t sensor_number = 0;            // cameras of one world have noise of their own
};

// What a scene is built from.
struct SceneRequest {
  int parameter = 0;              // the number after the colon
  std::uint64_t seed = 1;         // of textures, of what stands where, and of the hand
  bool identical_places = false;  // every place holds the same things as the first: nothing tells them apart
};

// A scene by name, with what the number after the colon means and may be.
struct SceneRecipe {
  const char* name;
  const char* parameter_meaning;  // one phrase for the list of scenes
  int default_parameter, lowest_parameter, highest_parameter;
  Scene (*build)(const SceneRequest& request);
};
std::span<const SceneRecipe> SceneRecipes();

// A table with things on it in a furnished room; the camera swings about it and comes back (`general`).
// parameter: how many times it also turns on the spot, away from the table and back (`rotation`).
Scene BuildRoom(const SceneRequest& request);
// A nave with look-alike bays along both sides: `buildK`, `travel`, then `visitK` in another order.
Scene BuildMuseum(const SceneRequest& request);
// Look-alike desks in a row, labelled in the same way.
Scene BuildDesks(const SceneRequest& request);
// Inside a textured cylinder of 1 m diameter: 100 frames of a quarter turn, looking outward from a circle of
// `parameter` centimetres (Pirchheim, Schmalstieg and Reitmayr 2013, section 7.3). One label, `rotation`.
Scene BuildCylinder(const SceneRequest& request);
// A lawn of one repeated texture. `general`.
Scene BuildGrass(const SceneRequest& request);
// What a person sees who works at the room's table with one camera in the hand and one on the shoulder, 94
// degrees across: scenes of one seed are views of the same walk. parameter: 0 the cameras move each on its
// own, 1 they are fixed to one another as WearableRig says. `general`.
Scene BuildHand(const SceneRequest& request);
Scene BuildShoulder(const SceneRequest& request);
// The same person's camera on the shoulder when it can turn its head: the way and the lens of BuildShoulder.
Scene BuildHead(const SceneRequest& request);
// hand_from_shoulder of the rigid pair.
engine::Rigid3 WearableRig();
// Once around something in a hall (`loop`) and a little further (`revisit`). parameter: 0 a block of cabinets
// that one looks over, 1 a round tower up to the ceiling, of which each place is seen on arriving there
// alone.
Scene BuildLoop(const SceneRequest& request);

}  // namespace docent::app
