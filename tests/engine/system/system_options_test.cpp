// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>

#include "engine/base/error.h"
#include "engine/system/system.h"
#include "tests/engine/refused_options.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(SystemOptions, AreRefusedOutOfRange) {
  ExpectRefused<SystemOptions>({[](auto* o) { o->provisional.time = -o->provisional.time; },
                                [](auto* o) { o->lost_time_before_new_map = Timestamp(-1); },
                                [](auto* o) { o->provisional.keyframes = 0; },
                                [](auto* o) { o->tracker.good_quality = kNaN; },
                                [](auto* o) { o->mapper.max_queue = 0; }});
}

TEST(RigOptions, AreRefusedOutOfRange) {
  ExpectRefused<RigOptions>({[](auto* o) { o->min_samples = 0; },
                             [](auto* o) { o->window = o->min_samples - 1; },
                             [](auto* o) { o->max_rigid_rotation_deg = 0; }});
}

TEST(CalibrationMonitorOptions, AreRefusedOutOfRange) {
  ExpectRefused<CalibrationMonitorOptions>({[](auto* o) { o->min_rings = 7; },
                                            [](auto* o) { o->min_samples = 1; },
                                            [](auto* o) { o->warning_px = kNaN; }});
}

TEST(InitializationMonitorOptions, AreRefusedOutOfRange) {
  ExpectRefused<InitializationMonitorOptions>({[](auto* o) { o->min_inlier_ratio_kept = 1.2; },
                                               [](auto* o) { o->max_distance = 0; },
                                               [](auto* o) { o->recent_period = Timestamp(-1); }});
}

TEST(System, ThrowsForInvalidOptions) {
  SystemOptions options;
  options.tracker.max_sigma = 0;
  EXPECT_THROW(System(options, {testing_world::Camera()}), Error);
}

TEST(CameraRig, ThrowsForInvalidOptions) {
  RigOptions options;
  options.min_samples = 0;
  EXPECT_THROW(CameraRig{options}, Error);
}

TEST(CalibrationMonitor, ThrowsForInvalidOptions) {
  CalibrationMonitorOptions options;
  options.min_ring_matches = 0;
  EXPECT_THROW(CalibrationMonitor(testing_world::Camera(), options), Error);
}

TEST(InitializationMonitor, ThrowsForInvalidOptions) {
  InitializationMonitorOptions options;
  options.max_rotation = kNaN;
  EXPECT_THROW(InitializationMonitor{options}, Error);
}

}  // namespace
}  // namespace docent::engine
