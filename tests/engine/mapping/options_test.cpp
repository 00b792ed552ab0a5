// SPDX-License-Identifier: Apache-2.0
// The options of initialization, matching, recognition and mapping.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/initialization/initializer.h"
#include "engine/initialization/planar_target.h"
#include "engine/initialization/target_initializer.h"
#include "engine/initialization/two_view_consensus.h"
#include "engine/mapping/bundle/bundle_adjustment.h"
#include "engine/mapping/mapper.h"
#include "engine/matching/pose_refinement.h"
#include "engine/recognition/absolute_pose.h"
#include "engine/recognition/descriptor_database.h"
#include "engine/recognition/word_bag.h"

namespace docent::engine {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Applies a change to default options and returns what they say of themselves.
template <typename Options, typename Change>
std::function<std::optional<std::string>()> After(Change change) {
  return [change] {
    Options options;
    change(&options);
    return options.Validate();
  };
}

TEST(EngineOptions, AreValidByDefault) {
  EXPECT_EQ(MapperOptions().Validate(), std::nullopt);
  EXPECT_EQ(InitializerOptions().Validate(), std::nullopt);
  EXPECT_EQ(PlanarTargetOptions().Validate(), std::nullopt);
  EXPECT_EQ(TargetStartOptions().Validate(), std::nullopt);
  EXPECT_EQ(ConsensusOptions().Validate(), std::nullopt);
  EXPECT_EQ(PoseRefinementOptions().Validate(), std::nullopt);
  EXPECT_EQ(BundleOptions().Validate(), std::nullopt);
  EXPECT_EQ(AbsolutePoseOptions().Validate(), std::nullopt);
  EXPECT_EQ(WordBagOptions().Validate(), std::nullopt);
  EXPECT_EQ(DescriptorDatabase::MatchOptions().Validate(), std::nullopt);
}

TEST(EngineOptions, SayInOneSentenceWhatIsOutOfRange) {
  const struct {
    std::function<std::optional<std::string>()> validate;
    const char* sentence;
  } cases[] = {
      {After<SearchOptions>([](auto* o) { o->min_correlation = 1.5f; }),
       "The correlation of an aligned patch must be from -1 to 1."},
      {After<GuidedMatchingOptions>([](auto* o) { o->radius_px = 0; }),
       "The radius of guided matching must be above 0."},
      {After<PoseRefinementOptions>([](auto* o) { o->iterations = 0; }),
       "The number of iterations of the pose refinement must be at least 1."},
      {After<LoopVerificationOptions>([](auto* o) { o->max_points = 0; }),
       "At least one point of a loop candidate must be searched."},
      {After<LoopCandidateSearchOptions>([](auto* o) { o->max_ratio = kNaN; }),
       "The ratio of the distances of two matches must be from 0 to 1."},
      {After<LoopDetectorOptions>([](auto* o) { o->min_consecutive = 0; }),
       "A loop needs at least one keyframe."},
      {After<PoseGraphOptions>([](auto* o) { o->max_iterations = 0; }),
       "The number of iterations of a pose graph must be at least 1."},
      {After<LoopCorrectionOptions>([](auto* o) { o->edges = 0; }),
       "The number of edges of a keyframe must be at least 1."},
      {After<LoopOptions>([](auto* o) { o->correction.graph.min_decrease = -1; }),
       "The decrease of the cost of a pose graph must be at least 0."},
      {After<MapOverlapOptions>([](auto* o) { o->min_cells = 17; }),
       "The number of occupied cells of a view must be from 0 to 16."},
      {After<MapJoiningOptions>([](auto* o) { o->max_cost_ratio = 1.1; }),
       "The cost ratio of two adjustments after joining must be from 0 to 1."},
      {After<BundleOptions>([](auto* o) { o->min_sigma = 0; }),
       "The smallest sigma of the residuals of a bundle adjustment must be above 0."},
      {After<MapAdjustmentOptions>([](auto* o) { o->window = -1; }),
       "The number of keyframes of a local adjustment must be at least 0."},
      {After<InfinitePointOptions>([](auto* o) { o->max_points[1] = -1; }),
       "The number of infinite points of a level must be at least 0."},
      {After<LocalizationOptions>([](auto* o) { o->min_inliers = 3; }),
       "The number of inliers of a panorama keyframe must be at least 4."},
      {After<AppearanceOptions>([](auto* o) { o->levels_around = -1; }),
       "The number of further levels of a description must be at least 0."},
      {After<KeyFrameCullingOptions>([](auto* o) { o->min_redundant_ratio = 1.01; }),
       "The ratio of points of a redundant keyframe must be from 0 to 1."},
      {After<PointCreationOptions>([](auto* o) { o->min_parallax_deg = kInfinity; }),
       "The parallax of a new point must be above 0."},
      {After<SelfCalibrationOptions>([](auto* o) {
         o->fields_of_view_deg = {60, 180};
       }),
       "Each field of view must be between 0 and 180 degrees."},
      {After<LensEstimationOptions>([](auto* o) { o->growth = 1; }),
       "The growth between two estimates of a lens must be above 1."},
      {After<LensEstimationOptions>([](auto* o) { o->lenses.emplace_back(); }),
       "Each unknown lens needs an initial model."},
      {After<AbsolutePoseOptions>([](auto* o) { o->pixel_angle = 0; }),
       "The angle of a pixel must be above 0."},
      {After<ConsensusOptions>([](auto* o) { o->confidence = 2; }),
       "The confidence of two views must be from 0 to 1."},
      {After<TargetStartOptions>([](auto* o) { o->min_matches = 0; }),
       "The number of matches of a planar target must be at least 1."},
      {After<StartConfirmationOptions>([](auto* o) { o->min_growth = -0.1; }),
       "The growth of the parallax to the third view must be at least 0."},
      {After<PlanarTargetOptions>([](auto* o) { o->corners.corners[0] = -1; }),
       "The number of described corners of a level must be at least 0."},
      {After<DepthNoiseOptions>([](auto* o) { o->calibration_share = kNaN; }),
       "The calibration error of the motion must be at least 0."},
      {After<TwoViewOptions>([](auto* o) { o->min_inliers = 7; }),
       "The number of inliers of two views must be at least 8."},
      {After<InitializerOptions>([](auto* o) { o->attempt_interval = 0; }),
       "The interval between two estimates must be at least 1."},
      {After<WordBagOptions>([](auto* o) { o->corners.min_score = -1; }),
       "The score of a described corner must be at least 0."},
      {After<DescriptorDatabase::MatchOptions>([](auto* o) { o->leaves = 17; }),
       "The number of searched leaves must be from 1 to 16."},
      {After<MapperOptions>([](auto* o) { o->max_queue = 0; }),
       "The queue of the mapper must hold at least one keyframe."},
      {After<MapperOptions>([](auto* o) { o->max_neighbour_baseline = o->min_neighbour_baseline; }),
       "The largest baseline of a neighbour must exceed the smallest."},
  };
  for (const auto& test : cases) EXPECT_EQ(test.validate(), test.sentence);
}

TEST(MapperOptions, IncludeThoseOfEachTask) {
  const std::vector<std::function<void(MapperOptions*)>> changes = {
      [](auto* o) { o->guided_matching.radius_px = -1; },
      [](auto* o) { o->creation.min_distance_px = 0; },
      [](auto* o) { o->infinite.min_distance_px = 0; },
      [](auto* o) { o->localization.inlier_px = 0; },
      [](auto* o) { o->appearance.inlier_px = 0; },
      [](auto* o) { o->culling.min_observers = 0; },
      [](auto* o) { o->adjustment.local_iterations = 0; },
      [](auto* o) { o->loops.detector.search.verification.radius_px = 0; },
      [](auto* o) { o->joining.overlap.search.inlier_px = 0; },
      [](auto* o) { o->lens.calibration.k1_prior_sigma = 0; },
      [](auto* o) { o->search.max_direct_shift_px = 0; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    MapperOptions options;
    changes[i](&options);
    EXPECT_TRUE(options.Validate()) << "change " << i;
    EXPECT_THROW(Mapper{options}, Error) << "change " << i;
  }
}

// Default options after a change.
template <typename Options, typename Change>
Options With(Change change) {
  Options options;
  change(&options);
  return options;
}

TEST(EngineOptions, AreRefusedWhereTheyEnter) {
  EXPECT_THROW(PointSearcher(With<SearchOptions>([](auto* o) { o->max_direct_shift_px = 0; })), Error);
  EXPECT_THROW(Initializer(With<InitializerOptions>([](auto* o) { o->attempt_interval = 0; }), nullptr, 1),
               Error);
  EXPECT_THROW(LensEstimation(With<LensEstimationOptions>([](auto* o) { o->growth = 0; })), Error);
  EXPECT_THROW(LoopCloser(With<LoopOptions>([](auto* o) { o->correction.edges = 0; }), {}), Error);
  BundleProblem problem;
  EXPECT_THROW(AdjustBundle(With<BundleOptions>([](auto* o) { o->min_sigma = 0; }), &problem), Error);
  Map map;
  EXPECT_THROW(
      AdjustGlobally(With<MapAdjustmentOptions>([](auto* o) { o->global_iterations = 0; }), nullptr, &map),
      Error);
  EXPECT_THROW(JoinMaps(With<MapJoiningOptions>([](auto* o) { o->max_rounds = -1; }), {}, {}, nullptr),
               Error);
  EXPECT_THROW(EstimateAbsolutePose({}, {}, With<AbsolutePoseOptions>([](auto* o) { o->inlier_px = 0; })),
               Error);
  EXPECT_THROW(EstimateTwoViews({}, {}, With<TwoViewOptions>([](auto* o) { o->inlier_px = 0; })), Error);
}

}  // namespace
}  // namespace docent::engine
