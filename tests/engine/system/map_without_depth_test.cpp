// SPDX-License-Identifier: Apache-2.0
// A map that got no depth in the session that began it.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "engine/system/system.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;

constexpr int kStillImages = 8;

// The camera stands still at this height, then moves sideways, and turns a little.
Frame Image(int index, double down) {
  static const testing_world::RenderedWorld world = testing_world::Chamber(101);
  const double moved = 0.008 * std::max(0, index - kStillImages);
  return testing_world::MakeFrame(index, world, CameraAt({moved, down, 0}, {0, -4 * moved, 0}));
}

SystemOptions InLockstep() {
  SystemOptions options;
  options.threaded = false;
  return options;
}

TEST(MapWithoutDepth, GetsDepthInALaterSession) {
  constexpr std::uint64_t kKey = 7;
  std::shared_ptr<const MapSnapshot> stored;
  {
    System system(InLockstep(), {Camera()});
    system.StartMap(kKey, 0);
    for (int i = 0; i < kStillImages; ++i) {
      const TrackedFrame tracked = system.Process(Image(i, 0));
      if (tracked.map) stored = tracked.map;
    }
  }
  ASSERT_TRUE(stored);
  ASSERT_FALSE(stored->HasFinitePoints());
  System system(InLockstep(), {Camera()});
  MapPermissions permissions;
  permissions.discard = false;  // it has content
  system.AddMap(kKey, stored, permissions);
  system.place_index().SetMap(kKey, stored);
  system.EnterMap(kKey, 0);
  TrackedFrame tracked;
  int lost = 0;
  for (int i = 0; i < 70; ++i) {
    tracked = system.Process(Image(i, 0.02));  // other images at the times of the stored ones
    lost += i >= kStillImages && !HasPose(tracked.state);
  }
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(tracked.map_key, kKey);
  ASSERT_TRUE(tracked.map);
  EXPECT_TRUE(tracked.map->HasFinitePoints());
  EXPECT_GT(tracked.finite_points, 50);
}

}  // namespace
}  // namespace docent::engine
