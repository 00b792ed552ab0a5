// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/simulator/scene.h"
#include "content/scene.h"
#include "engine/base/error.h"
#include "engine/dense/light_estimate.h"
#include "engine/dense/surface_samples.h"
#include "tests/app/support/exact_mesh.h"
#include "tests/app/support/simulated_map.h"
#include "tests/support/must_run.h"
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

// A box of one colour on a surface that the camera sees, as a model and as part of the simulator's world.
struct PlacedBox {
  Eigen::Vector3d base = Eigen::Vector3d::Zero();  // The middle of its underside, in the world.
  double side_m = 0;
  content::Entity entity;
  std::unique_ptr<Simulation> simulation;  // The place with the box, without noise.
};

constexpr double kBoxYaw = 0.6;
constexpr std::array<int, 3> kBoxBgr = {150, 160, 170};

content::Entity BoxModel(const Eigen::Vector3d& base, double side_m) {
  auto model = std::make_shared<content::Model>();
  content::Material material;
  for (int i = 0; i < 3; ++i)
    material.base_color[i] =
        static_cast<float>(engine::LinearFromLevel(kBoxBgr[static_cast<std::size_t>(2 - i)]));
  material.metallic = 0;
  material.roughness = 1;
  model->materials.push_back(material);
  content::Primitive primitive;
  primitive.material = 0;
  const float half = 0.5F * static_cast<float>(side_m);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      const auto first = static_cast<std::uint32_t>(primitive.vertices.size());
      for (const auto& [u, v] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
        content::Vertex vertex;
        vertex.normal = glm::vec3(0);
        vertex.normal[axis] = sign;
        vertex.position[axis] = sign * half;
        vertex.position[(axis + 1) % 3] = static_cast<float>(u) * half;
        vertex.position[(axis + 2) % 3] =
            static_cast<float>(v) * half * sign;  // Counterclockwise from outside.
        vertex.position.y += half;
        primitive.vertices.push_back(vertex);
      }
      for (const std::uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U}) primitive.indices.push_back(first + corner);
    }
  }
  model->meshes.push_back({"box", {primitive}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  model->bounds_min = {-half, 0, -half};
  model->bounds_max = {half, 2 * half, half};
  auto asset = std::make_shared<content::Asset>();
  asset->model = std::move(model);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.model.asset = asset;
  // y of the model is up, and the yaw is that of AddBox.
  Eigen::Matrix3d axes;
  axes << std::cos(kBoxYaw), 0, -std::sin(kBoxYaw), 0, -1, 0, -std::sin(kBoxYaw), 0, -std::cos(kBoxYaw);
  entity.model.map_from_model.rotation = engine::Rotation3(axes);
  entity.model.map_from_model.translation = base;
  return entity;
}

PlacedBox BoxIn(const std::string& name, std::uint64_t seed, const Simulation& simulation, int frame) {
  const engine::CameraModel& camera = simulation.camera();
  PlacedBox box;
  box.base = simulation.SurfaceAt(frame, {0.5 * camera.width_px(), 0.7 * camera.height_px()}).value();
  box.side_m = 0.2 * (box.base - simulation.world_from_camera(frame).translation).norm();
  box.entity = BoxModel(box.base, box.side_m);
  Scene scene = SceneOf(name, seed);
  const int texture =
      scene.surfaces.AddTexture(cv::Mat(16, 16, CV_8UC3, cv::Scalar(kBoxBgr[0], kBoxBgr[1], kBoxBgr[2])));
  scene.surfaces.AddBox(box.base, box.side_m, box.side_m, box.side_m, kBoxYaw, texture);
  SimulationOptions options = SimulationOptions::Clean();
  options.duration_s = simulation.options().duration_s;
  options.seed = seed;
  box.simulation = std::make_unique<Simulation>(name, std::move(scene), options);
  return box;
}

struct BoxFigures {
  double color_error = 0;  // Largest relative error of the mean of a colour channel.
  double shadow_deg = -1;  // Of its direction on the ground; negative without one.
  int pixels = 0;
};

// Draws the box into the place without it and compares the pixels that show it with those of the simulator.
BoxFigures Compare(const PlacedBox& box, const Simulation& without, int frame,
                   const engine::LightEstimate* light, ui::Renderer* renderer, cv::Mat* images) {
  engine::TrackedFrame tracked;
  tracked.state = engine::TrackingState::kSixDof;
  tracked.camera_from_map = without.world_from_camera(frame).inverse();
  without.Render(frame, &tracked.frame.image);
  content::Scene scene;
  scene.entities = {box.entity};
  ui::View view;
  view.tracked = &tracked;
  view.camera = &without.camera();
  view.scene = &scene;
  view.light = light;
  view.overlay.hud = false;
  cv::Mat drawn, plain, truth;
  renderer->Draw(view);
  renderer->ReadBack(&drawn);
  view.shadows = false;
  renderer->Draw(view);
  renderer->ReadBack(&plain);
  box.simulation->Render(frame, &truth);
  cv::Mat shows_box = cv::Mat::zeros(drawn.size(), CV_8UC1);
  Eigen::Vector3d towards_shadow = Eigen::Vector3d::Zero();
  const engine::Rigid3 world_from_camera = without.world_from_camera(frame);
  for (int y = 0; y < drawn.rows; ++y) {
    for (int x = 0; x < drawn.cols; ++x) {
      const auto seen = box.simulation->SurfaceAt(frame, Eigen::Vector2d(x, y)),
                 behind = without.SurfaceAt(frame, Eigen::Vector2d(x, y));
      if (seen && behind && (*seen - *behind).norm() > 1e-4) shows_box.at<std::uint8_t>(y, x) = 255;
      const int darker = plain.at<cv::Vec3b>(y, x)[1] - drawn.at<cv::Vec3b>(y, x)[1];
      const auto ray = without.camera().Unproject({x, y});
      if (darker < 8 || !ray) continue;
      const Eigen::Vector3d direction = world_from_camera.rotation * *ray;
      const double way = (box.base.y() - world_from_camera.translation.y()) / direction.y();
      const Eigen::Vector3d offset = world_from_camera.translation + way * direction - box.base;
      if (way > 0 && offset.norm() > 1.1 * box.side_m) towards_shadow += offset.normalized();
    }
  }
  cv::erode(shows_box, shows_box, cv::Mat(), {-1, -1}, 2);
  const cv::Scalar mean_drawn = cv::mean(plain, shows_box), mean_true = cv::mean(truth, shows_box);
  BoxFigures figures;
  figures.pixels = cv::countNonZero(shows_box);
  for (int i = 0; i < 3; ++i)
    figures.color_error = std::max(figures.color_error, std::abs(mean_drawn[i] / mean_true[i] - 1));
  if (light != nullptr && light->direct > 0 && towards_shadow.norm() > 0) {
    const Eigen::Vector3d level(-kToLight.x(), 0, -kToLight.z());
    figures.shadow_deg =
        std::acos(std::clamp(level.normalized().dot(towards_shadow.normalized()), -1.0, 1.0)) * 180 /
        std::numbers::pi;
  }
  cv::hconcat(drawn, truth, *images);
  return figures;
}

// The places of a test. All twelve take minutes.
struct TestedPlace {
  const char* name;
  std::uint64_t seed;
  bool long_test;
};
constexpr std::array<TestedPlace, 12> kTestedPlaces = {{{"room", 1, false},
                                                        {"room", 2, true},
                                                        {"room", 3, false},
                                                        {"museum", 1, false},
                                                        {"museum", 2, true},
                                                        {"museum", 3, true},
                                                        {"desks", 1, false},
                                                        {"desks", 2, true},
                                                        {"desks", 3, true},
                                                        {"loop", 1, false},
                                                        {"loop", 2, true},
                                                        {"loop", 3, true}}};

// Tests five places, or all twelve if DOCENT_LONG_TESTS is set.
TEST(RoomLight, OnAModelIsThatOfTheSimulator) {
  std::unique_ptr<ui::OffscreenContext> context;
  try {
    context = std::make_unique<ui::OffscreenContext>();
  } catch (const Error& error) {
    SKIP_OR_FAIL(error.what());
  }
  ui::Renderer renderer;
  const bool all = std::getenv("DOCENT_LONG_TESTS") != nullptr;
  int tested = 0, within_a_tenth = 0;
  for (const auto& [name, seed, long_test] : kTestedPlaces) {
    if (long_test && !all) continue;
    ++tested;
    SimulationOptions options = SimulationOptions::Clean();
    options.duration_s = 8;
    options.seed = seed;
    const auto without = MakeSimulation(name, options);
    const int frame = without->frame_count() / 2;
    const PlacedBox box = BoxIn(name, seed, *without, frame);
    const Place place = PlaceIn(name, seed);
    const auto light = engine::EstimateLight(*place.map, place.mesh);
    const std::string scene = std::string(name) + "-" + std::to_string(seed);
    ASSERT_TRUE(light) << scene;
    cv::Mat images;
    const BoxFigures figures = Compare(box, *without, frame, &*light, &renderer, &images);
    cv::Mat images_of_fixed;
    const BoxFigures fixed = Compare(box, *without, frame, nullptr, &renderer, &images_of_fixed);
    const char* const folder = std::getenv("DOCENT_TEST_IMAGES");
    if (folder != nullptr) cv::imwrite(std::string(folder) + "/light-" + scene + ".png", images);
    std::printf(
        "%s: direction %s, colour off by %.1f %% (with the fixed light %.1f %%), shadow by %.1f degrees, "
        "%d pixels\n",
        scene.c_str(), light->direct > 0 ? "known" : "not known", 100 * figures.color_error,
        100 * fixed.color_error, figures.shadow_deg, figures.pixels);
    EXPECT_GT(figures.pixels, 500) << scene;
    if (figures.color_error < 0.1) ++within_a_tenth;
    EXPECT_LT(figures.color_error, 0.25) << scene << " (measured: at most 0.185, museum-2)";
    if (light->direct > 0) {
      EXPECT_LT(figures.shadow_deg, 50) << scene << " (measured: desks-1 25.1, room-3 42.7)";
    }
  }
  // Measured: in all but museum-1, museum-2 and room-2.
  EXPECT_GE(within_a_tenth, tested - (all ? 4 : 2));
}

TEST(RoomLight, ComesFromWhereTheSimulatorHasIt) {
  int known = 0;
  for (const char* const name : {"museum", "desks"}) {
    for (const std::uint64_t seed : {1u, 2u}) {
      const Place place = PlaceIn(name, seed);
      const auto start = std::chrono::steady_clock::now();
      const auto light = engine::EstimateLight(*place.map, place.mesh);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      ASSERT_TRUE(light) << name << ' ' << seed;
      const bool is_known = light->direct > 0;
      std::printf("%s %d: %s, %.2f s\n", name, static_cast<int>(seed),
                  is_known
                      ? (std::to_string(AngleToLight_deg(*light)) + " degrees, direct " +
                         std::to_string(light->direct) + ", mean " + std::to_string(light->brightness[0]))
                            .c_str()
                      : "not known",
                  seconds);
      if (!is_known) continue;
      ++known;
      EXPECT_LT(AngleToLight_deg(*light), 15) << name << ' ' << seed;
    }
  }
  EXPECT_GE(known, 1) << "measured: one of four; in the others halves of the places disagree";
}

}  // namespace
}  // namespace docent::app
