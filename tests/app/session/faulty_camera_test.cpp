// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "tests/app/support/faulty_camera.h"

// Must hold for every camera, however faulty: a map that it initializes agrees with the ground truth.
namespace docent::app {
namespace {

class FaultyCamera : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Session, FaultyCamera, ::testing::Values("room", "museum:1", "desks:2"),
                         [](const auto& scene) {
                           const std::string name = scene.param;
                           return name.substr(0, name.find(':'));
                         });

TEST_P(FaultyCamera, InitializesAMapThatAgreesWithTheTruth) {
  for (const std::uint64_t seed : {1, 2}) {
    const auto simulation = faulty_camera::Sequence(GetParam(), seed, 4);
    SessionOptions options = simulated_session::Options(Pace::kLockstep, "map");
    options.seed = seed;
    Session session(options, simulated_session::LensOf(*simulation), nullptr);
    const auto seen = simulated_session::Feed(simulation, Pace::kLockstep, &session);
    const auto starts = faulty_camera::StartsOf(seen, *simulation);
    EXPECT_FALSE(starts.empty()) << "seed " << seed << ": no map of points within four seconds";
    for (const faulty_camera::Start& start : starts) {
      EXPECT_LT(start.error_m, 0.1 * start.path_m)
          << "seed " << seed << ": the map of frame " << start.frame << " is false";
    }
  }
}

}  // namespace
}  // namespace docent::app
