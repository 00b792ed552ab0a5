// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/scene.h"

namespace docent::app {

std::span<const SceneRecipe> SceneRecipes() {
  static constexpr SceneRecipe kRecipes[] = {
      {"room", "number of pure rotations away from the table and back", 0, 0, 20, BuildRoom},
      {"museum", "number of bays, which look alike", 4, 1, 24, BuildMuseum},
      {"desks", "number of desks, which look alike", 6, 1, 24, BuildDesks},
      {"cylinder", "radius of the camera's circle in centimetres", 10, 0, 40, BuildCylinder},
      {"loop", "a loop around cabinets (0), or around a tower that hides what lies ahead (1)", 0, 0, 1,
       BuildLoop},
      {"hand", "0 for a hand-held camera, 1 for one that is mounted rigidly to the shoulder camera", 0, 0, 1,
       BuildHand},
      {"shoulder", "the shoulder camera of the same person: 0 free, 1 mounted rigidly to the hand camera", 0,
       0, 1, BuildShoulder},
      {"head", "the shoulder camera of the same person, with a pan-tilt head", 0, 0, 0, BuildHead},
      {"grass", "over a lawn of one repeated texture", 0, 0, 0, BuildGrass},
  };
  return kRecipes;
}

}  // namespace docent::app
