// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "maps/maintenance/densify.h"
#include "maps/storage/mesh_rows.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/surface_accuracy.h"
#include "ui/context.h"

// The surfaces of maps that the program itself built in a simulated scene, against the truth: errors of the
// camera poses and of the scale are part of it. Counters:
//   keyframes, depth_s_per_keyframe, mesh_s   size of the map, time of the depth and of the mesh
//   complete, accurate      share of the pixels that two keyframes see whose depth is within 2 % of the
//                           truth; the same of those that have a depth
//   mesh_complete_2, mesh_accurate_2 and so on
//                           the same two shares of the mesh as the keyframes see it, for each of
//                           kDepthTolerances in percent
//   triangles, mesh_kB      of the mesh as it is stored
//   hidden, wrongly_hidden  share of the content pixels behind a surface that are hidden; of those before it
//   edge_px                 median distance of the edges of objects in the drawn image from the true ones
//   flicker                 share of the content pixels that change from hidden to shown, or back, from one
//                           frame to the next without cause
// DOCENT_BENCH_SCENE (default room), DOCENT_BENCH_SEED (default 1) and DOCENT_BENCH_SECONDS (default 12)
// choose the scene, its seed and the duration. SurfaceDepth measures the mesh's depth only. With
// DOCENT_BENCH_IMAGES, the drawn images are written to that folder.
//
//   docent_bench --benchmark_filter=DenseSurfaces
namespace docent::bench {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// A map that was built from a simulation, with its place in the world.
struct BuiltMap {
  std::shared_ptr<const app::Simulation> simulation;
  std::shared_ptr<const engine::MapSnapshot> map;
  std::vector<int> keyframes;  // The frame of each keyframe.
  engine::Sim3 world_from_map;
};

BuiltMap Build(const std::string& scene, std::uint64_t seed, double seconds) {
  app::SimulationOptions options;
  options.duration_s = seconds;
  options.seed = seed;
  BuiltMap built;
  built.simulation = app::MakeSimulation(scene, options);
  app::simulated_session::SourceRun run = app::simulated_session::RunSource(
      app::OpenSimulation(built.simulation), app::Pace::kLockstep,
      app::simulated_session::Options(app::Pace::kLockstep, "map"), nullptr);
  built.map = run.maps.front().snapshot;
  std::vector<Eigen::Vector3d> in_map, in_world;
  for (const engine::KeyFrame& keyframe : built.map->keyframes) {
    int frame = 0;
    while (frame + 1 < built.simulation->frame_count() && built.simulation->time(frame) < keyframe.time)
      ++frame;
    built.keyframes.push_back(frame);
    in_map.push_back(keyframe.camera_from_map.OriginInSource());
    in_world.push_back(built.simulation->world_from_camera(frame).translation);
  }
  built.world_from_map = engine::AlignSim3(in_world, in_map).value();
  return built;
}

// The true pose of a frame in the map, so that the error of tracking is not measured too.
engine::Rigid3 CameraFromMap(const BuiltMap& built, int frame) {
  const engine::Rigid3 camera_from_world = built.simulation->world_from_camera(frame).inverse();
  const engine::Sim3& world_from_map = built.world_from_map;
  return {camera_from_world.rotation * world_from_map.rotation,
          camera_from_world * world_from_map.translation / world_from_map.scale};
}

app::OcclusionFigures MeasureHiding(const BuiltMap& built, const engine::SurfaceMesh& mesh) {
  const ui::OffscreenContext context;
  ui::Renderer renderer;
  const auto surfaces = std::make_shared<const engine::SurfaceMesh>(mesh);
  const char* const folder = std::getenv("DOCENT_BENCH_IMAGES");
  app::OcclusionFigures figures;
  constexpr int kFirst = 45, kEvery = 60;
  for (int i = kFirst; i < built.simulation->frame_count(); i += kEvery) {
    cv::Mat image;
    app::AddOcclusion(*built.simulation, i, CameraFromMap(built, i), 1 / built.world_from_map.scale,
                      built.keyframes, surfaces, &renderer, &figures, &image);
    if (i + 1 < built.simulation->frame_count())
      app::AddFlicker(*built.simulation, i, {CameraFromMap(built, i), CameraFromMap(built, i + 1)},
                      1 / built.world_from_map.scale, surfaces, &renderer, &figures);
    if (folder != nullptr)
      cv::imwrite((std::filesystem::path(folder) / ("occlusion-" + std::to_string(i) + ".png")).string(),
                  image);
  }
  return figures;
}

BuiltMap BuildChosen() {
  const char* const scene = std::getenv("DOCENT_BENCH_SCENE");
  const char* const seed = std::getenv("DOCENT_BENCH_SEED");
  const char* const seconds = std::getenv("DOCENT_BENCH_SECONDS");
  return Build(scene != nullptr ? scene : "room", seed != nullptr ? std::strtoull(seed, nullptr, 10) : 1,
               seconds != nullptr ? std::atof(seconds) : 12);
}

void AddMeshDepth(const BuiltMap& built, const engine::SurfaceMesh& mesh, benchmark::State* state) {
  const app::DepthFigures figures =
      app::MeasureMesh(*built.simulation, built.map, mesh, 1, built.keyframes, built.world_from_map);
  for (std::size_t i = 0; i < app::kDepthTolerances.size(); ++i) {
    std::ostringstream percent;
    percent << 100 * app::kDepthTolerances[i];
    state->counters["mesh_complete_" + percent.str()] = figures.Completeness(i);
    state->counters["mesh_accurate_" + percent.str()] = figures.Accuracy(i);
  }
}

void SurfaceDepth(benchmark::State& state) {
  for (auto _ : state) {
    const BuiltMap built = BuildChosen();
    const auto mesh = engine::DensifyMap(built.map);
    state.counters["keyframes"] = static_cast<double>(built.map->keyframes.size());
    AddMeshDepth(built, mesh->mesh, &state);
  }
}
BENCHMARK(SurfaceDepth)->Unit(benchmark::kSecond)->Iterations(1);

void DenseSurfaces(benchmark::State& state) {
  for (auto _ : state) {
    const BuiltMap built = BuildChosen();
    const app::DepthFigures depth =
        app::MeasureDepthMaps(*built.simulation, built.map, built.keyframes, built.world_from_map);
    const auto start = Clock::now();
    double depth_s = 0;
    std::size_t done = 0;
    const auto mesh = engine::DensifyMap(built.map, {}, [&](std::size_t count, std::size_t) {
      depth_s = SecondsSince(start);
      done = count;
    });
    const double mesh_s = SecondsSince(start) - depth_s;
    const app::OcclusionFigures hiding = MeasureHiding(built, mesh->mesh);
    state.counters["keyframes"] = static_cast<double>(built.map->keyframes.size());
    state.counters["depth_s_per_keyframe"] = depth_s / static_cast<double>(done);
    state.counters["mesh_s"] = mesh_s;
    state.counters["complete"] = depth.Completeness();
    state.counters["accurate"] = depth.Accuracy();
    AddMeshDepth(built, mesh->mesh, &state);
    state.counters["triangles"] = static_cast<double>(mesh->mesh.triangles.size());
    state.counters["mesh_kB"] = static_cast<double>(maps::MeshBytes(*mesh)) / 1000;
    state.counters["hidden"] = hiding.HiddenShare();
    state.counters["wrongly_hidden"] = hiding.WronglyHiddenShare();
    state.counters["edge_px"] = hiding.MedianEdgeError_px();
    state.counters["flicker"] = hiding.ChangedShare();
  }
}
BENCHMARK(DenseSurfaces)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace docent::bench
