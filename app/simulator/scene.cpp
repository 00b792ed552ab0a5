// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/scene.h"

namespace docent::app {

std::span<const SceneRecipe> SceneRecipes() {
  static constexpr SceneRecipe kRecipes[] = {
      {"room", "how many times the camera turns on the spot, away from the table and back", 0, 0, 20,
       BuildRoom},
      {"museum", "how many look-alike bays", 4, 1, 24, BuildMuseum},
      {"desks", "how many look-alike desks", 6, 1, 24, BuildDesks},
      {"cylinder", "radius of the camera's circle in centimetres", 10, 0, 40, BuildCylinder},
      {"loop", "once around cabinets (0), or around a tower that hides the way ahead (1)", 0, 0, 1,
       BuildLoop},
      {"hand", "0 for a hand-held camera, 1 for one that is fixed to the shoulder's", 0, 0, 1, BuildHand},
      {"shoulder", "the same person's camera on the shoulder: 0 free, 1 fixed to the hand's", 0, 0, 1,
       BuildShoulder},
      {"head", "the same person's camera on the shoulder, which can turn its head", 0, 0, 0, BuildHead},
      {"grass", "over a lawn of one repeated texture", 0, 0, 0, BuildGrass},
  };
  return kRecipes;
}

}  // namespace docent::app
