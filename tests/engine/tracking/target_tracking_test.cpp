// SPDX-License-Identifier: Apache-2.0
// Runs a tracker and a mapper that initialize from a planar target, a printed image of known width.
#include <gtest/gtest.h>

#include <vector>

#include "tests/engine/initialization/target_scene.h"
#include "tests/engine/lockstep.h"

namespace docent::engine {
namespace {

using testing_world::BoardCamera;
using testing_world::CameraAt;
using testing_world::TargetScene;

class TargetTracking : public testing::TestWithParam<bool> {};

TEST_P(TargetTracking, MakesAMapInMetres) {
  static const TargetScene scene(31, true);
  TrackerOptions options;
  options.hybrid = GetParam();
  options.target = std::make_shared<const PlanarTarget>(scene.image, scene.width_m);
  Lockstep lockstep(options, BoardCamera(), 1);
  std::vector<Rigid3> truth, tracked;
  Hint first_hint = Hint::kNone;
  for (int i = 0; i < 36; ++i) {
    const Rigid3 pose = CameraAt({-0.15 + 0.02 * i, 0.05, 0.1}, {0, -0.4 * i, 0});
    const std::uint64_t noise_seed = static_cast<std::uint64_t>(i) + 1;
    const auto map = lockstep.map();
    const TrackedFrame out =
        lockstep.Feed(testing_world::MakeFrame(i, scene.world.Render(*BoardCamera(), pose, 1.5, noise_seed)));
    if (i == 0) first_hint = out.hint;
    if (map && map->HasFinitePoints() && HasPose(out.state)) {
      truth.push_back(pose);
      tracked.push_back(out.camera_from_map);
    }
  }
  EXPECT_EQ(first_hint, Hint::kMoveSideways);
  ASSERT_GT(tracked.size(), 15u);
  // No alignment is needed: the width of the target gives the map its scale in metres.
  const double tracked_distance = (tracked.back().OriginInSource() - tracked.front().OriginInSource()).norm();
  const double true_distance = (truth.back().OriginInSource() - truth.front().OriginInSource()).norm();
  EXPECT_NEAR(tracked_distance, true_distance, 0.03 * true_distance);
}

INSTANTIATE_TEST_SUITE_P(Engines, TargetTracking, testing::Bool(), [](const auto& parameter) {
  return parameter.param ? std::string("Hybrid") : std::string("SixDof");
});

}  // namespace
}  // namespace docent::engine
