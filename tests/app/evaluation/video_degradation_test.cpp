// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/vision/features.h"
#include "tests/app/support/simulated_map.h"
#include "ui/image_degradation.h"
#include "ui/video_exposure.h"

// Noise, exposure time and lens shading, as they are estimated from simulated images and a map without error.
namespace docent::app {
namespace {

struct Camera {
  double noise = 1.5;  // Of each channel, grey levels.
  double exposure_s = 1.0 / 60;
  double vignetting = 0;
  const char* scene = "room";
};

struct Estimate {
  double noise = 0, exposure_s = 0, shading = 0;
};

constexpr int kFrames = 60;

// The first of kFrames frames about the fastest turn.
int FirstFrame(const Simulation& simulation) {
  int fastest = 0;
  double greatest = 0;
  for (int frame = 1; frame < simulation.frame_count(); ++frame) {
    const double angle = (simulation.world_from_camera(frame).rotation.inverse() *
                          simulation.world_from_camera(frame - 1).rotation)
                             .Angle();
    if (angle > greatest) {
      greatest = angle;
      fastest = frame;
    }
  }
  return std::clamp(fastest - kFrames / 2, 0, simulation.frame_count() - kFrames);
}

// The map is one of a sharp camera without shading; its points are found at the finest level.
std::shared_ptr<const engine::MapSnapshot> SharpMap(const Simulation& clean, int first) {
  std::vector<int> frames;
  for (int frame = first; frame < first + kFrames; frame += 6) frames.push_back(frame);
  engine::MapSnapshot map = *SimulatedMap(clean, frames);
  for (engine::MapPoint& point : map.points) {
    point.source_pixel =
        engine::LevelZeroFromLevel(point.source_pixel.cast<double>(), point.source_level).cast<float>();
    point.source_level = 0;
  }
  return std::make_shared<const engine::MapSnapshot>(std::move(map));
}

Estimate EstimateOf(const Camera& camera) {
  SimulationOptions options = SimulationOptions::Clean();
  options.duration_s = 12;
  options.camera = SimulatedCamera(320);
  const auto clean = MakeSimulation(camera.scene, options);
  const int first = FirstFrame(*clean);
  const auto map = SharpMap(*clean, first);
  options.noise_sigma = camera.noise;
  options.exposure_s = camera.exposure_s;
  options.blur_samples = 6;
  options.vignetting = camera.vignetting;
  const auto real = MakeSimulation(camera.scene, options);
  ui::DegradationEstimator degradation;
  ui::VideoExposure exposure;
  Estimate estimate;
  for (int frame = first; frame < first + kFrames; ++frame) {
    engine::TrackedFrame tracked;
    tracked.state = engine::TrackingState::kSixDof;
    tracked.map = map;
    tracked.map_key = 1;
    tracked.frame.time = real->time(frame);
    tracked.camera_from_map = real->world_from_camera(frame).inverse();
    real->Render(frame, &tracked.frame.image);
    for (const engine::MapPoint& point : map->points) {
      const Eigen::Vector3d place = point.point_in_map.head<3>();
      if (!real->IsVisible(frame, place)) continue;
      const auto pixel = real->camera().Project(tracked.camera_from_map * place);
      if (pixel && real->camera().IsInside(*pixel))
        tracked.matches.push_back({point.id, pixel->cast<float>(), 0, true});
    }
    estimate.noise = 255.0 * degradation.Update(&tracked).noise;
    exposure.Update(&tracked);
  }
  estimate.exposure_s = degradation.exposure_s();
  estimate.shading = exposure.shading();
  return estimate;
}

// The simulator's noise is that of each channel, so that that of the grey level is less.
const double kGrayShare = std::sqrt(0.114 * 0.114 + 0.587 * 0.587 + 0.299 * 0.299);

TEST(VideoDegradation, IsEstimatedAsTheSimulatorMakesIt) {
  for (const char* const scene : {"room:1", "museum:2"}) {
    for (const Camera& camera : {Camera{1.5, 1.0 / 120, 0, scene}, Camera{5, 1.0 / 60, 0.3, scene},
                                 Camera{3, 1.0 / 35, 0.15, scene}}) {
      const Estimate estimate = EstimateOf(camera);
      // The shading is that of grey levels, which are encoded with an exponent of about 1 / 2.2.
      const double shading = 2.2 * std::log(1 - camera.vignetting);
      std::printf("%s: noise %.2f (%.2f), exposure %.1f ms (%.1f), shading %.2f (%.2f)\n", scene,
                  estimate.noise, camera.noise * kGrayShare, 1e3 * estimate.exposure_s,
                  1e3 * camera.exposure_s, estimate.shading, shading);
      EXPECT_NEAR(estimate.noise, camera.noise * kGrayShare, 0.15 * camera.noise) << scene;
      EXPECT_NEAR(estimate.exposure_s, camera.exposure_s, 0.007) << scene << " (measured: up to 5 ms)";
      EXPECT_NEAR(estimate.shading, shading, 0.3) << scene << " (measured: up to 0.28 of 0.78)";
    }
  }
}

}  // namespace
}  // namespace docent::app
