// SPDX-License-Identifier: Apache-2.0
// A map that starts with the infinite points of one image and gains depth later.
#include <gtest/gtest.h>

#include "engine/mapping/mapper.h"
#include "engine/vision/features.h"
#include "tests/engine/mapping/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;

// The first view of the pair becomes the reference instead of the first image, which must then be localized
// like any other dependent keyframe.
TEST(PanoramaStart, TheFirstImageIsLocalizedOnceTheMapHasFinitePoints) {
  const auto world = testing_world::Chamber(61);
  const auto camera = testing_world::PinholeCamera(400, 300);
  const auto image = [&](const Rigid3& pose, std::uint64_t seed) {
    return MakeFeatures(world.Render(*camera, pose, 1.5, seed));
  };
  Mapper mapper({});
  KeyFrameCandidate first;
  first.choice = KeyFrameChoice::kFirst;
  first.time = FromSeconds(0);
  first.camera = camera;
  first.features = image(CameraAt({0, 0, 0}), 1);
  ASSERT_TRUE(mapper.Offer(first));
  mapper.Step();
  ASSERT_NE(mapper.Snapshot(), nullptr);
  const Rigid3 a = CameraAt({0, 0, 0}, {0, 6, 0}), b = CameraAt({0.1, 0, 0}, {0, 6, 0});
  InitialPair pair;
  pair.camera = camera;
  pair.a = {FromSeconds(1), image(a, 2)};
  pair.b = {FromSeconds(1.5), image(b, 3)};
  pair.a_from_map = a;
  pair.geometry.outcome = TwoViewOutcome::kGeneral;
  pair.geometry.b_from_a = b * a.inverse();
  pair.geometry.b_from_a.translation /= 0.1;
  for (int level = 2; level >= 0; --level) {
    for (const Corner& corner : pair.a.features->corners[static_cast<std::size_t>(level)]) {
      const Eigen::Vector2d pixel = LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), level);
      const auto hit = world.AtPixel(*camera, a, pixel);
      if (pair.matches.size() >= 300 || !hit || !world.Sees(*camera, b, hit->point)) continue;
      pair.matches.push_back({pixel.cast<float>(), camera->Project(b * hit->point)->cast<float>(),
                              static_cast<std::uint8_t>(level)});
      pair.geometry.points_in_a.push_back(a * hit->point / 0.1);
      pair.geometry.inlier.push_back(true);
    }
  }
  pair.geometry.inlier_count = static_cast<int>(pair.matches.size());
  mapper.Start(pair);
  for (int step = 0; step < 50 && mapper.Step(); ++step) {
  }
  const auto map = mapper.Snapshot();
  ASSERT_TRUE(map->HasFinitePoints());
  ASSERT_NE(map->FindKeyFrame(0), nullptr);
  EXPECT_EQ(map->FindKeyFrame(0)->kind, KeyFrameKind::kSixDof);
}

}  // namespace
}  // namespace docent::engine
