// SPDX-License-Identifier: Apache-2.0
// A map that starts with the infinite points of one image and gains depth later.
#include <gtest/gtest.h>

#include "engine/mapping/mapper.h"
#include "engine/vision/features.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"
#include "tests/engine/mapping/true_pair.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::TruePair;

// The first view of the pair becomes the reference instead of the first image, which must then be localized
// like any other dependent keyframe.
TEST(PanoramaStart, TheFirstImageIsLocalizedOnceTheMapHasFinitePoints) {
  const auto world = testing_world::Chamber(61);
  const auto camera = testing_world::PinholeCamera(400, 300);
  Mapper mapper({});
  KeyFrameCandidate first;
  first.choice = KeyFrameChoice::kFirst;
  first.time = FromSeconds(0);
  first.camera = camera;
  first.features = MakeFeatures(world.Render(*camera, CameraAt({0, 0, 0}), 1.5, 3));
  ASSERT_TRUE(mapper.Offer(first));
  mapper.Step();
  ASSERT_NE(mapper.Snapshot(), nullptr);
  const Rigid3 a = CameraAt({0, 0, 0}, {0, 6, 0}), b = CameraAt({0.1, 0, 0}, {0, 6, 0});
  InitialPair pair = TruePair(world, *camera, camera, a, b, 300);
  pair.a.time = FromSeconds(1);
  pair.b.time = FromSeconds(1.5);
  pair.a_from_map = a;
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
