// SPDX-License-Identifier: Apache-2.0
#include "maps/upkeep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::IsEmpty;

// A map as the engine makes them: points on a wavy wall, seen where they are, by keyframes in a row.
std::shared_ptr<engine::MapSnapshot> MakeTrueMap() {
  auto map = MakeSampleMap(1, {.keyframes = 6, .points = 0, .width_px = 320, .height_px = 240});
  map->panoramas.clear();
  for (std::size_t i = 0; i < map->keyframes.size(); ++i) {
    engine::KeyFrame& keyframe = map->keyframes[i];
    keyframe.kind = engine::KeyFrameKind::kSixDof;
    keyframe.panorama = engine::kNoId;
    keyframe.fixed = i < 2;  // two hold the scale
    keyframe.camera = map->keyframes.front().camera;
    const double x = 0.2 * static_cast<double>(i);
    keyframe.camera_from_map = {engine::Rotation3::Exp({0.01 * x, -0.1 * x, 0.02}), {-x, 0.02 * x, 0.1 * x}};
  }
  for (std::uint32_t i = 0; i < 300; ++i) {
    engine::MapPoint point;
    point.id = i;
    const double x = -1.2 + 0.15 * (i % 20), y = -0.9 + 0.12 * (i / 20);
    point.point_in_map = {x, y, 3 + 0.4 * std::sin(3 * x) * std::cos(2 * y), 1};
    point.source_keyframe = map->keyframes.front().id;
    map->points.push_back(point);
  }
  map->next_point = 300;
  for (const engine::KeyFrame& keyframe : map->keyframes) {
    for (const engine::MapPoint& point : map->points) {
      const auto pixel = keyframe.camera->Project(keyframe.camera_from_map * point.position());
      if (pixel && keyframe.camera->IsInside(*pixel, 1))
        map->observations.push_back({keyframe.id, point.id, pixel->cast<float>(), 0});
    }
  }
  return map;
}

TEST(Upkeep, BringsAMapThatWasLeftCrookedBackToTheTruth) {
  const TemporaryFolder folder;
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes);
  const auto truth = MakeTrueMap();
  ASSERT_EQ(engine::Validate(*truth), "");
  EXPECT_LT(ReprojectionRms(*truth, *truth), 1e-4);
  auto crooked = std::make_shared<engine::MapSnapshot>(*truth);
  Random random(4);
  for (engine::KeyFrame& keyframe : crooked->keyframes) {
    if (!keyframe.fixed) keyframe.camera_from_map.translation.x() += random.Uniform(-0.01, 0.01);
  }
  for (engine::MapPoint& point : crooked->points) point.point_in_map[2] += random.Uniform(-0.02, 0.02);
  for (const Policy policy : {Policy::kOpen, Policy::kReadOnly}) {
    const std::uint64_t key = library.NewKey();
    library.Save({key, ToString(policy), policy, crooked, nullptr});
    const Optimization result = OptimizeMap(&library, key, nullptr);
    const auto stored = library.Load(key).snapshot;
    if (policy == Policy::kReadOnly) {
      EXPECT_EQ(result.outcome, Optimization::Outcome::kNotAllowed);
      EXPECT_EQ(FirstDifference(*stored, *crooked), "");
      continue;
    }
    EXPECT_EQ(result.outcome, Optimization::Outcome::kAdjusted);
    EXPECT_GT(result.rms_before_px, 0.3);
    EXPECT_LT(result.rms_after_px, 0.01);
    for (std::size_t i = 0; i < stored->keyframes.size(); ++i) {
      EXPECT_LT(
          (stored->keyframes[i].camera_from_map.translation - truth->keyframes[i].camera_from_map.translation)
              .norm(),
          1e-3);
    }
    const std::atomic<bool> interrupt = true;
    EXPECT_NE(OptimizeMap(&library, key, &interrupt).outcome, Optimization::Outcome::kAdjusted);
  }
  EXPECT_THAT(library.Verify(), IsEmpty());
}

}  // namespace
}  // namespace docent::maps
