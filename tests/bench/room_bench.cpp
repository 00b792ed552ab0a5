// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <opencv2/core.hpp>

#include "content/scene.h"
#include "engine/dense/light_estimate.h"
#include "ui/context.h"
#include "ui/renderer.h"

// What an image costs whose content belongs to the room: a model of 70,000 triangles on a floor of 120,000,
// at 640x480 and 1280x720. The parts are the differences between these:
//   video      the image alone
//   content    with the model
//   composite  with the model and one small surface, so that it is composited as with surfaces
//   surfaces   with the model and what hides it
//   shadows    with the model and its shadows on the plane that it stands on
//   all        with all of it
//   turning    with all of it, the model turning, so that the depths for its shadows are drawn in each image
// The camera moves a little from image to image.
//
//   docent_bench --benchmark_filter=RoomContent
namespace docent::bench {
namespace {

constexpr int kVideo = 0, kContent = 1, kComposite = 2, kSurfaces = 3, kShadows = 4, kAll = 5, kTurning = 6;

std::shared_ptr<const content::Asset> Ball() {
  constexpr int kRings = 134, kSegments = 262;  // 2 x 133 x 262 = 69,692 triangles.
  auto model = std::make_shared<content::Model>();
  content::Material material;
  material.base_color = {0.6f, 0.5f, 0.4f, 1};
  material.metallic = 0;
  material.roughness = 0.6f;
  model->materials.push_back(material);
  content::Primitive primitive;
  primitive.material = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    for (int segment = 0; segment < kSegments; ++segment) {
      const double polar = std::numbers::pi * ring / (kRings - 1);
      const double around = 2 * std::numbers::pi * segment / kSegments;
      content::Vertex vertex;
      vertex.normal = {static_cast<float>(std::sin(polar) * std::cos(around)),
                       static_cast<float>(-std::cos(polar)),
                       static_cast<float>(std::sin(polar) * std::sin(around))};
      vertex.position = 0.5f * (vertex.normal + glm::vec3(0, 1, 0));
      primitive.vertices.push_back(vertex);
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring) {
    for (std::uint32_t segment = 0; segment < kSegments; ++segment) {
      const std::uint32_t a = ring * kSegments + segment, b = ring * kSegments + (segment + 1) % kSegments;
      primitive.indices.insert(primitive.indices.end(),
                               {a, a + kSegments, b, b, a + kSegments, b + kSegments});
    }
  }
  model->meshes.push_back({"ball", {primitive}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  model->bounds_min = {-0.5f, 0, -0.5f};
  model->bounds_max = {0.5f, 1, 0.5f};
  auto asset = std::make_shared<content::Asset>();
  asset->model = std::move(model);
  return asset;
}

// y = 1, with a block before the right half of the model.
std::shared_ptr<const engine::SurfaceMesh> FloorWithBlock() {
  constexpr std::uint32_t kSide = 245;  // 2 x 244 x 244 = 119,072 triangles.
  auto mesh = std::make_shared<engine::SurfaceMesh>();
  for (std::uint32_t v = 0; v < kSide; ++v) {
    for (std::uint32_t u = 0; u < kSide; ++u) {
      const float x = 6.0F * static_cast<float>(u) / (kSide - 1) - 3,
                  z = 6.0F * static_cast<float>(v) / (kSide - 1);
      const bool is_block = x > 0 && x < 0.6F && z > 1.6F && z < 1.9F;
      mesh->vertices.emplace_back(x, is_block ? 0.4F : 1.0F, z);
    }
  }
  for (std::uint32_t v = 0; v + 1 < kSide; ++v) {
    for (std::uint32_t u = 0; u + 1 < kSide; ++u) {
      const std::uint32_t a = v * kSide + u;
      mesh->triangles.push_back({a, a + kSide, a + 1});
      mesh->triangles.push_back({a + 1, a + kSide, a + kSide + 1});
    }
  }
  return mesh;
}

// Where it hides nothing.
std::shared_ptr<const engine::SurfaceMesh> SmallSurface() {
  auto mesh = std::make_shared<engine::SurfaceMesh>();
  mesh->vertices = {{0, 0, 3.2F}, {0.01F, 0, 3.2F}, {0, 0.01F, 3.2F}};
  mesh->triangles = {{0, 1, 2}};
  return mesh;
}

void RoomContent(benchmark::State& state) {
  const ui::OffscreenContext context;
  ui::Renderer renderer;
  const int width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  const int parts = static_cast<int>(state.range(2));
  const double focal = 0.7 * width;
  const engine::CameraModel camera(engine::LensModel::kRadialTangential,
                                   {width, height, focal, focal, 0.5 * width, 0.5 * height},
                                   {-0.1, 0, 0, 0, 0});
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.model.asset = Ball();
  entity.model.map_from_model.rotation = engine::Rotation3::Exp({std::numbers::pi, 0, 0});
  entity.model.map_from_model.translation = {0, 1, 2.6};
  content::Scene scene;
  if (parts != kVideo) scene.entities = {entity};
  engine::TrackedFrame tracked;
  tracked.state = engine::TrackingState::kSixDof;
  tracked.frame.image.create(height, width, CV_8UC3);
  cv::randu(tracked.frame.image, 60, 200);
  engine::LightEstimate light;
  light.brightness[0] = 0.6;
  light.to_light = Eigen::Vector3d(-0.5, -0.8, -0.3).normalized();
  light.direct = 0.5;
  ui::View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.scene = &scene;
  view.overlay.hud = false;
  view.shadows = parts >= kShadows;
  view.light = view.shadows ? &light : nullptr;
  if (parts == kComposite) view.surfaces = SmallSurface();
  if (parts == kSurfaces || parts >= kAll) view.surfaces = FloorWithBlock();
  cv::Mat image;
  double step = 0;
  for (auto _ : state) {
    step += 1;
    tracked.camera_from_map.translation.x() = 0.02 * std::sin(step);
    if (parts == kTurning)
      scene.entities.front().model.map_from_model.rotation =
          engine::Rotation3::Exp({std::numbers::pi, 0, 0}) * engine::Rotation3::Exp({0, 0.01 * step, 0});
    renderer.Draw(view);
    renderer.ReadBack(&image);
  }
}
BENCHMARK(RoomContent)
    ->ArgNames({"width", "height", "parts"})
    ->ArgsProduct({{640}, {480}, {kVideo, kContent, kComposite, kSurfaces, kShadows, kAll, kTurning}})
    ->ArgsProduct({{1280}, {720}, {kVideo, kContent, kComposite, kSurfaces, kShadows, kAll, kTurning}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
