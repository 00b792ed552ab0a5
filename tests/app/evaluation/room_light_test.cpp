// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "app/simulator/scene.h"
#include "engine/base/error.h"
#include "engine/dense/light_estimate.h"
#include "engine/dense/surface_samples.h"
#include "tests/app/support/exact_mesh.h"
#include "tests/app/support/simulated_map.h"
#include "ui/context.h"
#include "ui/renderer.h"

// The light that is estimated from maps without error, against that of the simulator, whose boxes and columns
// are shaded by a light from the upper left front (surfaces.cpp); its walls and floors have brightnesses of
// their own.
namespace docent::app {
namespace {

const Eigen::Vector3d kToLight = Eigen::Vector3d(-0.45, -0.8, -0.4).normalized();

struct Place {
  std::unique_ptr<Simulation> simulation;
  std::shared_ptr<const engine::MapSnapshot> map;
  engine::SurfaceMesh mesh;
  std::vector<int> frames;
};

Scene SceneOf(const std::string& name, std::uint64_t seed) {
  SceneRequest request;
  request.seed = seed;
  for (const SceneRecipe& recipe : SceneRecipes()) {
    if (recipe.name != name) continue;
    request.parameter = recipe.default_parameter;
    return recipe.build(request);
  }
  throw Error("There is no scene " + name + ".");
}

Place PlaceIn(const std::string& name, std::uint64_t seed) {
  SimulationOptions options;
  options.duration_s = 8;
  options.seed = seed;
  Place place;
  place.mesh = ExactMesh(SceneOf(name, seed).surfaces, 0.04);
  place.simulation = MakeSimulation(name, options);
  place.frames = EvenlySpacedFrames(*place.simulation, 10);
  place.map = SimulatedMap(*place.simulation, place.frames);
  return place;
}

double AngleToLight_deg(const engine::LightEstimate& light) {
  return std::acos(std::clamp(light.to_light.dot(kToLight), -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(RoomLight, ComesFromWhereTheSimulatorHasIt) {
  int known = 0;
  for (const char* const name : {"museum", "desks"}) {
    for (const std::uint64_t seed : {1u, 2u}) {
      const Place place = PlaceIn(name, seed);
      const auto start = std::chrono::steady_clock::now();
      const auto light = engine::EstimateLight(*place.map, place.mesh);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      std::printf("%s %d: %s, %.2f s\n", name, static_cast<int>(seed),
                  light ? (std::to_string(AngleToLight_deg(*light)) + " degrees, direct " +
                           std::to_string(light->direct) + ", mean " + std::to_string(light->brightness[0]))
                              .c_str()
                        : "not known",
                  seconds);
      if (!light) continue;
      ++known;
      EXPECT_LT(AngleToLight_deg(*light), 15) << name << ' ' << seed;
    }
  }
  EXPECT_GE(known, 1) << "measured: one of four; in the others halves of the places disagree";
}

}  // namespace
}  // namespace docent::app
