// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "engine/base/random.h"
#include "engine/initialization/track_readout.h"
#include "tests/engine/rendered_world.h"

// Corners that a moving camera with a rolling shutter sees, for tests.
namespace docent::engine::testing_world {

using CameraPath = std::function<Rigid3(double)>;  // camera from world, by the time in seconds

// A hand that sways: it turns by up to 0.5 radians per second and moves by 0.1 metres per second, at
// distances of two to four metres.
inline CameraPath Swaying(std::uint64_t seed) {
  Random random(seed);
  std::vector<double> phases;
  for (int i = 0; i < 6; ++i) phases.push_back(random.Uniform(0, 6.28));
  return [phases](double t) {
    const auto sway = [&](std::size_t i, double hertz) { return std::sin(6.28 * hertz * t + phases[i]); };
    const Eigen::Vector3d angles(0.03 * sway(0, 1.1), 0.06 * sway(1, 0.9), 0.02 * sway(2, 1.3)),
        centre(0.1 * t + 0.01 * sway(3, 1), 0.01 * sway(4, 1.2), 0.02 * sway(5, 0.8));
    const Rotation3 rotation = Rotation3::Exp(angles);
    return Rigid3(rotation, -(rotation * centre));
  };
}

struct RolledScene {
  CameraPath motion = Swaying(1);
  Eigen::Vector2d readout_s = {0, 0.02};
  int images = 20, corners = 150;
  double noise_px = 0.05;
  int wrong = 0;        // corners that drift
  double drift_px = 1;  // per image
  std::uint64_t seed = 1;
  CameraModel camera = *Camera();  // the true one
};

// The pixel where a rolling shutter exposes a point.
inline std::optional<Eigen::Vector2d> ExposedPixel(const RolledScene& scene, const Eigen::Vector3d& point,
                                                   double time) {
  auto pixel = scene.camera.Project(scene.motion(time) * point);
  for (int i = 0; i < 5 && pixel; ++i) {
    const double delay = scene.readout_s.dot(scene.camera.ReadoutPosition(*pixel));
    pixel = scene.camera.Project(scene.motion(time + delay) * point);
  }
  return pixel && scene.camera.IsInside(*pixel) ? pixel : std::nullopt;
}

inline CornerSequence ShowCorners(const RolledScene& scene) {
  constexpr double kInterval_s = 1 / 30.0;
  CornerSequence sequence;
  for (int i = 0; i < scene.images; ++i) {
    const Rigid3 now = scene.motion(i * kInterval_s), before = scene.motion((i - 1) * kInterval_s);
    sequence.images.push_back({FromSeconds(i * kInterval_s), now.rotation * before.rotation.inverse()});
  }
  Random random(scene.seed);
  const auto noise = [&] { return scene.noise_px * 1.7 * random.Uniform(-1, 1); };  // of this deviation
  while (static_cast<int>(sequence.corners.size()) < scene.corners) {
    const double depth = random.Uniform(2, 4);
    const Eigen::Vector3d point(random.Uniform(-0.8, 0.8) * depth, random.Uniform(-0.6, 0.6) * depth, depth);
    const bool wrong = static_cast<int>(sequence.corners.size()) < scene.wrong;
    CornerSequence::Corner corner;
    for (int i = 0; i < scene.images; ++i) {
      const auto pixel = ExposedPixel(scene, point, i * kInterval_s);
      if (!pixel) break;
      corner.pixels.push_back(
          Eigen::Vector2d(pixel->x() + noise() + (wrong ? scene.drift_px * i : 0), pixel->y() + noise())
              .cast<float>());
    }
    if (corner.pixels.size() == sequence.images.size()) sequence.corners.push_back(corner);
  }
  return sequence;
}

}  // namespace docent::engine::testing_world
