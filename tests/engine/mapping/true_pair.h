// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "engine/initialization/initial_pair.h"
#include "engine/vision/features.h"
#include "tests/engine/rendered_world.h"

// The two views that a mapper starts with, without any error, for tests.
namespace docent::engine::testing_world {

// Corners of the first view and their pixels in the second, as `camera` sees them in a rendered world, and
// their true positions; at most max_matches of them. The pair says that it was seen by assumed_camera. Both
// views have time 0. The baseline is one unit long, and its length in metres is not given.
inline InitialPair TruePair(const RenderedWorld& world, const CameraModel& camera,
                            const std::shared_ptr<const CameraModel>& assumed_camera, const Rigid3& a,
                            const Rigid3& b, std::size_t max_matches) {
  InitialPair pair;
  pair.camera = assumed_camera;
  pair.a.features = MakeFeatures(world.Render(camera, a, 1.5, 1));
  pair.b.features = MakeFeatures(world.Render(camera, b, 1.5, 2));
  pair.geometry.outcome = TwoViewOutcome::kGeneral;
  pair.geometry.b_from_a = b * a.inverse();
  const double baseline_m = pair.geometry.b_from_a.translation.norm();
  pair.geometry.b_from_a.translation /= baseline_m;
  for (int level = 2; level >= 0; --level) {
    for (const Corner& corner : pair.a.features->corners[static_cast<std::size_t>(level)]) {
      const Eigen::Vector2d pixel = LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), level);
      const auto hit = world.AtPixel(camera, a, pixel);
      if (pair.matches.size() >= max_matches || !hit || !world.Sees(camera, b, hit->point)) continue;
      pair.matches.push_back({pixel.cast<float>(), camera.Project(b * hit->point)->cast<float>(),
                              static_cast<std::uint8_t>(level)});
      pair.geometry.points_in_a.push_back(a * hit->point / baseline_m);
      pair.geometry.inlier.push_back(true);
    }
  }
  pair.geometry.inlier_count = static_cast<int>(pair.matches.size());
  return pair;
}

}  // namespace docent::engine::testing_world
