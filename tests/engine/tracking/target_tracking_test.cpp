// SPDX-License-Identifier: Apache-2.0
// A tracker and a mapper that start from a printed picture of known width.
#include <gtest/gtest.h>

#include <vector>

#include "engine/mapping/mapper.h"
#include "engine/tracking/tracker.h"
#include "tests/engine/mapping/target_scene.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::TargetScene;

class TargetTracking : public testing::TestWithParam<bool> {};

TEST_P(TargetTracking, MakesAMapInMetres) {
  static const TargetScene scene(31, true);
  static const auto camera = testing_world::PinholeCamera(640, 480);
  TrackerOptions options;
  options.hybrid = GetParam();
  options.target = std::make_shared<const PlanarTarget>(scene.picture, scene.width_m);
  Tracker tracker(options, camera, 1);
  Mapper mapper({});
  tracker.StartNewMap();
  std::shared_ptr<const MapSnapshot> map;
  std::vector<Rigid3> truth, tracked;
  std::string first_hint;
  for (int i = 0; i < 36; ++i) {
    const Rigid3 pose = CameraAt({-0.15 + 0.02 * i, 0.05, 0.1}, {0, -0.4 * i, 0});
    Frame frame;
    frame.time = FromSeconds(i / 30.0);
    frame.index = static_cast<std::uint64_t>(i);
    frame.picture = scene.world.Render(*camera, pose, 1.5, frame.index + 1);
    const TrackedFrame out = tracker.Track(frame, nullptr);
    if (i == 0) first_hint = out.hint;
    if (map && map->HasFinitePoints() && HasPose(out.state)) {
      truth.push_back(pose);
      tracked.push_back(out.camera_from_map);
    }
    if (auto pair = tracker.TakeInitialPair()) mapper.Start(std::move(*pair));
    if (auto candidate = tracker.TakeKeyFrameCandidate()) mapper.Offer(std::move(*candidate));
    for (int step = 0; step < 20 && !mapper.Settled(); ++step) mapper.Step();
    mapper.Step();
    if (mapper.Snapshot() != map) {
      map = mapper.Snapshot();
      tracker.SetMap(map, 1);
    }
  }
  EXPECT_EQ(first_hint, "move sideways");
  ASSERT_GT(tracked.size(), 15u);
  // No alignment: the map's unit is the metre, from the picture's width alone.
  const double went = (tracked.back().OriginInSource() - tracked.front().OriginInSource()).norm();
  const double truly = (truth.back().OriginInSource() - truth.front().OriginInSource()).norm();
  EXPECT_NEAR(went, truly, 0.03 * truly);
}

INSTANTIATE_TEST_SUITE_P(Engines, TargetTracking, testing::Bool(), [](const auto& parameter) {
  return parameter.param ? std::string("Hybrid") : std::string("SixDof");
});

}  // namespace
}  // namespace docent::engine
