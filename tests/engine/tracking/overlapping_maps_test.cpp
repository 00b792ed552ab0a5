// SPDX-License-Identifier: Apache-2.0
// Tests of a tracker that visits overlapping maps, which show the same wall.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/tracking/tracker.h"
#include "tests/engine/rendered_world.h"
#include "tests/engine/some_maps.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::SomeMaps;
using testing_world::World;

// A map with three keyframes, 10 cm apart, starting at x. Only one of every `period` points keeps its true
// position.
std::shared_ptr<const MapSnapshot> MapStartingAt(double x, std::size_t period) {
  return testing_world::MapWithDisplacedPoints(
      World(), Camera(), {CameraAt({x, 0, 0}), CameraAt({x + 0.1, 0, 0}), CameraAt({x + 0.2, 0, 0})},
      [=](std::size_t i) { return i % period != 0; });
}

// Walks from the place of map 1 to the place of map 2, and returns the key of the map that each frame was
// tracked in.
std::vector<std::uint64_t> WalkFromMap1ToMap2(const SomeMaps& maps, bool build_maps) {
  TrackerOptions options;
  options.build_maps = build_maps;
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(maps.At(1), 1);
  std::vector<std::uint64_t> keys;
  SomeMaps first_only;
  first_only.Add(1, maps.At(1));
  for (int i = 0; i < 40; ++i) {
    const Rigid3 truth = CameraAt({0.1 + 0.012 * i, 0.02, 0.03});
    const Frame frame = testing_world::MakeFrame(i, World(), truth);
    const TrackedFrame tracked = tracker.Track(frame, i < 5 ? &first_only : &maps);
    EXPECT_TRUE(HasPose(tracked.state) || i < 3) << i;
    if (HasPose(tracked.state)) {
      EXPECT_LT((tracked.camera_from_map.OriginInSource() - truth.OriginInSource()).norm(), 0.03) << i;
    }
    keys.push_back(tracked.map_key);
  }
  return keys;
}

TEST(OverlappingMaps, AreLeftForAMapWithHigherQuality) {
  SomeMaps maps;
  maps.Add(1, MapStartingAt(0, 2));
  maps.Add(2, MapStartingAt(0.4, 1));
  const auto keys = WalkFromMap1ToMap2(maps, false);
  EXPECT_EQ(keys[4], 1u);
  EXPECT_EQ(keys.back(), 2u);
  EXPECT_TRUE(std::is_sorted(keys.begin() + 4, keys.end())) << "the tracker must switch only once";
}

TEST(OverlappingMaps, AreKeptWhileTrackingIsGood) {
  SomeMaps maps;
  maps.Add(1, MapStartingAt(0, 1));
  maps.Add(2, MapStartingAt(0.4, 1));
  EXPECT_EQ(WalkFromMap1ToMap2(maps, false).back(), 1u);
}

TEST(OverlappingMaps, AreKeptWhileTheyAreExtended) {
  SomeMaps maps;
  maps.Add(1, MapStartingAt(0, 2));
  maps.Add(2, MapStartingAt(0.4, 1));
  EXPECT_EQ(WalkFromMap1ToMap2(maps, true).back(), 1u);
}

}  // namespace
}  // namespace docent::engine
