// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>

#include "engine/base/error.h"
#include "engine/tracking/tracker.h"
#include "tests/engine/refused_options.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(TrackerOptions, AreRefusedOutOfRange) {
  ExpectRefused<TrackerOptions>(
      {[](auto* o) { o->good_quality = 1.5; }, [](auto* o) { o->lost_quality = 0.4; },
       [](auto* o) { o->max_sigma = kNaN; }, [](auto* o) { o->max_verified = 0; },
       [](auto* o) { o->confirming_frames = 0; }, [](auto* o) { o->better_ratio = 0.9; },
       [](auto* o) { o->max_contradicted_ratio = 1.1; }, [](auto* o) { o->max_contradicted_area = -0.1; },
       [](auto* o) { o->min_cells = 17; }, [](auto* o) { o->map_tracker.max_fine = 0; },
       [](auto* o) { o->features.min_threshold = 0; }, [](auto* o) { o->initializer.attempt_interval = 0; },
       [](auto* o) { o->target_start.min_matches = 0; }, [](auto* o) { o->map_tracker.nearby.frames = 0; },
       [](auto* o) { o->keyframes.min_distance = -1; }, [](auto* o) { o->keyframe_policy.min_coverage = 2; },
       [](auto* o) { o->rotation_center.min_poses = 0; }});
}

TEST(TrackerOptions, SayWhatIsWrong) {
  TrackerOptions options;
  options.lost_quality = 0.4;
  EXPECT_EQ(options.Validate(), "The inlier ratio of a lost frame must be from 0 to 0.3.");
}

TEST(MapTrackerOptions, AreRefusedOutOfRange) {
  ExpectRefused<MapTrackerOptions>(
      {[](auto* o) { o->max_coarse = o->min_coarse - 1; }, [](auto* o) { o->coarse_radius_px = 0; },
       [](auto* o) { o->min_points_per_cell = 0; }, [](auto* o) { o->search.min_correlation = 2; },
       [](auto* o) { o->refinement.iterations = 0; }});
}

TEST(NearbyPointOptions, AreRefusedOutOfRange) {
  ExpectRefused<NearbyPointOptions>({[](auto* o) { o->keyframes = 0; },
                                     [](auto* o) { o->examined_keyframes = o->keyframes - 1; },
                                     [](auto* o) { o->max_difference_ratio = kNaN; }});
}

TEST(KeyFrameNoveltyOptions, AreRefusedOutOfRange) {
  ExpectRefused<KeyFrameNoveltyOptions>(
      {[](auto* o) { o->min_rotation_deg = 0; }, [](auto* o) { o->min_found_ratio = 1.1; }});
}

TEST(KeyFramePolicyOptions, AreRefusedOutOfRange) {
  ExpectRefused<KeyFramePolicyOptions>(
      {[](auto* o) { o->history = -o->history; }, [](auto* o) { o->min_view_ratio = kNaN; }});
}

TEST(RotationCenterOptions, AreRefusedOutOfRange) {
  ExpectRefused<RotationCenterOptions>(
      {[](auto* o) { o->position_noise = 0; }, [](auto* o) { o->window = -o->window; }});
}

TEST(DescriptorRelocalizerOptions, AreRefusedOutOfRange) {
  ExpectRefused<DescriptorRelocalizerOptions>({[](auto* o) { o->min_inliers = 2; },
                                               [](auto* o) { o->max_cached_maps = 0; },
                                               [](auto* o) { o->levels_around = -1; }});
}

TEST(Tracker, ThrowsForInvalidOptions) {
  TrackerOptions options;
  options.keyframes.min_distance = kNaN;
  EXPECT_THROW(Tracker(options, testing_world::Camera(), 1), Error);
}

TEST(DescriptorRelocalizer, ThrowsForInvalidOptions) {
  DescriptorRelocalizerOptions options;
  options.max_iterations = 0;
  EXPECT_THROW(DescriptorRelocalizer{options}, Error);
}

}  // namespace
}  // namespace docent::engine
