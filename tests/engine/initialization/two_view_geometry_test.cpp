// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/two_view_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "tests/engine/initialization/two_view_scene.h"

namespace docent::engine {
namespace {

using testing_scene::DepthAlong;
using testing_scene::DirectionErrorDeg;
using testing_scene::MakeTwoViews;
using testing_scene::Motion;
using testing_scene::OnPlane;
using testing_scene::SceneOptions;
using testing_scene::TwoViews;
using testing_scene::Volume;

constexpr int kSceneSeeds = 12;

bool IsAccepted(TwoViewOutcome outcome) {
  return outcome == TwoViewOutcome::kGeneral || outcome == TwoViewOutcome::kPlanar;
}

using MakeViews = std::function<TwoViews(const SceneOptions&, Random*)>;

struct Case {
  const char* name;
  MakeViews make;
};
std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.name;
}

std::string NameOf(const testing::TestParamInfo<Case>& test) {
  return test.param.name;
}

struct NoiseLevel {
  double noise_px, outlier_ratio;
};
// Noise and outlier ratios of real matches: good and worst.
constexpr NoiseLevel kNoises[] = {{0.5, 0.05}, {0.5, 0.4}, {1.0, 0.05}};

TwoViewResult EstimateFrom(const TwoViews& views, std::uint64_t seed, double outlier_ratio,
                           const DepthNoiseOptions& depth_noise = {}) {
  TwoViewOptions options;
  options.depth_noise = depth_noise;
  options.seed = seed;
  // Noise beyond the threshold rejects some of the correct pairs too.
  options.min_inlier_ratio = std::min(options.min_inlier_ratio, 0.8 * (1 - outlier_ratio));
  return EstimateTwoViews(views.rays_in_a, views.rays_in_b, options);
}

// Scenes from which a map must be initialized.

class TwoViewsWithParallax : public testing::TestWithParam<Case> {};

TEST_P(TwoViewsWithParallax, GiveTheTrueMotionAndStructure) {
  for (const auto& [noise_px, outlier_ratio] : kNoises) {
    int accepted = 0;
    std::vector<double> rotation_errors, direction_errors;
    for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
      Random random(seed * 7919);
      const TwoViews views =
          GetParam().make({.count = 400, .noise_px = noise_px, .outlier_ratio = outlier_ratio}, &random);
      ASSERT_EQ(views.correct.size(), 400u);
      const TwoViewResult result = EstimateFrom(views, seed, outlier_ratio);
      if (!IsAccepted(result.outcome)) continue;
      ++accepted;
      EXPECT_NEAR(result.b_from_a.translation.norm(), 1, 1e-9);
      rotation_errors.push_back(RotationErrorDeg(result.b_from_a, views.b_from_a));
      direction_errors.push_back(DirectionErrorDeg(result.b_from_a, views.b_from_a));
      EXPECT_EQ(result.inlier_count, std::count(result.inlier.begin(), result.inlier.end(), true));
      int correct = 0, wrong = 0;
      std::vector<double> depth_errors;
      for (std::size_t i = 0; i < views.correct.size(); ++i) {
        if (!result.inlier[i]) continue;
        (views.correct[i] ? correct : wrong)++;
        EXPECT_GT(result.points_in_a[i].dot(views.rays_in_a[i]), 0);
        if (!views.correct[i]) continue;
        const double scale = views.b_from_a.translation.norm();
        depth_errors.push_back(
            std::abs(scale * result.points_in_a[i].norm() / views.points_in_a[i].norm() - 1));
      }
      // The worst case: noise near the threshold, or a tenth of the points off the plane.
      const auto possible = std::count(views.correct.begin(), views.correct.end(), true);
      EXPECT_GE(correct, (noise_px > 0.7 ? 0.65 : 0.8) * static_cast<double>(possible)) << seed;
      EXPECT_LE(wrong, 8) << seed;  // outliers that lie on their epipolar lines by chance
      std::nth_element(depth_errors.begin(), depth_errors.begin() + depth_errors.size() / 2,
                       depth_errors.end());
      EXPECT_LT(depth_errors[depth_errors.size() / 2], 0.25) << seed;
    }
    // With this much noise, some of these motions are too small for the depth to be significant.
    if (noise_px > 0.7 && rotation_errors.empty()) continue;
    if (noise_px < 0.7) {
      EXPECT_GE(accepted, kSceneSeeds - 2) << "noise " << noise_px << " outliers " << outlier_ratio;
    }
    ASSERT_FALSE(rotation_errors.empty());
    std::sort(rotation_errors.begin(), rotation_errors.end());
    std::sort(direction_errors.begin(), direction_errors.end());
    const std::size_t middle = rotation_errors.size() / 2;
    EXPECT_LT(rotation_errors[middle], 0.3) << "noise " << noise_px << " outliers " << outlier_ratio;
    EXPECT_LT(rotation_errors.back(), 1.2) << "noise " << noise_px << " outliers " << outlier_ratio;
    EXPECT_LT(direction_errors[middle], 3.0) << "noise " << noise_px << " outliers " << outlier_ratio;
    EXPECT_LT(direction_errors.back(), 10.0) << "noise " << noise_px << " outliers " << outlier_ratio;
  }
}

INSTANTIATE_TEST_SUITE_P(
    TwoViewGeometry, TwoViewsWithParallax,
    testing::Values(
        Case{"RoomAnyDirection",
             [](const SceneOptions& o, Random* r) {
               Eigen::Vector3d direction = RandomDirection(r);
               direction.z() *= 0.3;
               return MakeTwoViews(Volume(2, 6), Motion(0.4 * direction.normalized(), 5 * RandomDirection(r)),
                                   o, r);
             }},
        Case{"LateralWithFourDegreesOfParallax",
             [](const SceneOptions& o, Random* r) {
               return MakeTwoViews(Volume(2, 4), Motion({0.2, 0.03, 0}, 3 * RandomDirection(r)), o, r);
             }},
        Case{"Forward",
             [](const SceneOptions& o, Random* r) {
               return MakeTwoViews(Volume(2, 6), Motion({0.02, 0.01, 0.8}, 2 * RandomDirection(r)), o, r);
             }},
        Case{"PlaneParallelToTheImage",
             [](const SceneOptions& o, Random* r) {
               const double angle = r->Uniform(0, 2 * kPi);
               return MakeTwoViews(
                   OnPlane({0, 0, 1}, 1),
                   Motion({0.2 * std::cos(angle), 0.2 * std::sin(angle), 0}, 3 * RandomDirection(r)), o, r);
             }},
        Case{"PlaneSlantedAlongTheMotion",
             [](const SceneOptions& o, Random* r) {
               return MakeTwoViews(OnPlane({0.6, 0.1, 0.8}, 1),
                                   Motion({0.1, 0.03, 0}, 3 * RandomDirection(r)), o, r);
             }},
        Case{"PlaneSlantedAcrossTheMotion",
             [](const SceneOptions& o, Random* r) {
               return MakeTwoViews(OnPlane({0, 0.6, 0.8}, 1), Motion({0.1, 0.01, 0}, 3 * RandomDirection(r)),
                                   o, r);
             }},
        Case{"PlaneWithATenthOfThePointsOffIt",
             [](const SceneOptions& o, Random* r) {
               const DepthAlong plane = OnPlane({0.5, 0.1, 0.85}, 1);
               return MakeTwoViews(
                   [=](const Eigen::Vector3d& ray, Random* random) {
                     return plane(ray, random) * (random->Uniform() < 0.1 ? 0.7 : 1.0);
                   },
                   Motion({0.1, 0.03, 0.05}, 3 * RandomDirection(r)), o, r);
             }},
        Case{"OrbitAroundAPlane",
             [](const SceneOptions& o, Random* r) {
               const double angle = Radians(12);
               return MakeTwoViews(OnPlane({0, 0, 1}, 1),
                                   Motion({std::sin(angle), 0, 1 - std::cos(angle)}, {0, 12, 0}), o, r);
             }}),
    NameOf);

// A lens without calibration error: with any error, a large rotation with a small translation says nothing
// about depth.
DepthNoiseOptions ExactLens() {
  DepthNoiseOptions options;
  options.calibration_share = 0;
  return options;
}

// The camera moves on a circle of 5 cm, looking outwards at a wall: it rotates by thirty degrees while it
// moves 26 mm.
TEST(TwoViewGeometry, RotatingAndMovingInFrontOfAWallGivesTheMotion) {
  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed * 7919);
    const double angle = Radians(30);
    const TwoViews views =
        MakeTwoViews(OnPlane({0, 0, 1}, 0.45),
                     Motion({0.05 * std::sin(angle), 0, 0.05 * std::cos(angle) - 0.05}, {0, -30, 0}),
                     {.count = 400, .noise_px = 0.15, .outlier_ratio = 0.2}, &random);
    const TwoViewResult result = EstimateFrom(views, seed, 0.2, ExactLens());
    if (!IsAccepted(result.outcome)) continue;
    ++accepted;
    EXPECT_LT(RotationErrorDeg(result.b_from_a, views.b_from_a), 0.4) << seed;
    EXPECT_LT(DirectionErrorDeg(result.b_from_a, views.b_from_a), 6) << seed;
    EXPECT_NEAR(result.median_parallax_deg, 3.1, 0.6);
  }
  EXPECT_GE(accepted, kSceneSeeds - 2);
}

// A curved wall, centred on the circle on which the camera moves: all points are equally far, so that a
// rotation alone explains nearly everything and only precisely tracked corners reveal the translation.
TEST(TwoViewGeometry, PreciseCornersOnAWallCurvedAroundTheCameraGiveTheMotion) {
  const auto curved = [](const Eigen::Vector3d& ray, Random*) {
    // |(0, 0, 0.05) + t ray| = 0.5 in the plane of the circle.
    const double a = ray.x() * ray.x() + ray.z() * ray.z(), b = 0.05 * ray.z(), c = 0.05 * 0.05 - 0.25;
    return (-b + std::sqrt(b * b - a * c)) / a;
  };
  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed * 7919);
    const double angle = Radians(25);
    const TwoViews views =
        MakeTwoViews(curved, Motion({0.05 * std::sin(angle), 0, 0.05 * std::cos(angle) - 0.05}, {0, -25, 0}),
                     {.count = 400, .noise_px = 0.1}, &random);
    const TwoViewResult result = EstimateFrom(views, seed, 0, ExactLens());
    if (!IsAccepted(result.outcome)) continue;
    ++accepted;
    EXPECT_LT(RotationErrorDeg(result.b_from_a, views.b_from_a), 0.4) << seed;
    EXPECT_LT(DirectionErrorDeg(result.b_from_a, views.b_from_a), 8) << seed;
  }
  EXPECT_GE(accepted, kSceneSeeds / 2);
}

TEST(TwoViewGeometry, PreciseCornersUnderPureRotationAreRejectedWithAFocalLengthOnePercentWrong) {
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    for (const double turn_deg : {8.0, 16.0, 24.0}) {
      Random random(seed * 7919);
      const TwoViews views = MakeTwoViews(Volume(2, 6), Motion({0, 0, 0}, {1, turn_deg, 0}),
                                          {.count = 400, .noise_px = 0.1, .focal_error = 1.01}, &random);
      EXPECT_FALSE(IsAccepted(EstimateFrom(views, seed, 0).outcome)) << seed << " " << turn_deg;
    }
  }
}

TEST(TwoViewGeometry, APlaneIsClassifiedAsPlanarAndARoomIsNot) {
  int planes = 0, rooms = 0;
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed);
    const SceneOptions options{.count = 400, .noise_px = 0.4, .outlier_ratio = 0.2};
    const TwoViews plane = MakeTwoViews(
        OnPlane({0.3, 0, 1}, 1), Motion({0.1, 0.02, 0}, 3 * RandomDirection(&random)), options, &random);
    const TwoViews room =
        MakeTwoViews(Volume(2, 6), Motion({0.3, 0.1, 0}, 3 * RandomDirection(&random)), options, &random);
    planes += EstimateFrom(plane, seed, 0.2).outcome == TwoViewOutcome::kPlanar;
    rooms += EstimateFrom(room, seed, 0.2).outcome == TwoViewOutcome::kGeneral;
  }
  EXPECT_GE(planes, kSceneSeeds - 2);
  EXPECT_EQ(rooms, kSceneSeeds);
}

// Scenes that must never be accepted, whatever the noise.

class TwoViewsWithoutStructure : public testing::TestWithParam<Case> {};

TEST_P(TwoViewsWithoutStructure, AreRejected) {
  for (const auto& [noise_px, outlier_ratio] : kNoises) {
    for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
      Random random(seed * 104729);
      const TwoViews views =
          GetParam().make({.count = 400, .noise_px = noise_px, .outlier_ratio = outlier_ratio}, &random);
      const TwoViewResult result = EstimateFrom(views, seed, outlier_ratio);
      EXPECT_FALSE(IsAccepted(result.outcome))
          << "noise " << noise_px << " outliers " << outlier_ratio << " seed " << seed;
      EXPECT_EQ(result.inlier_count, 0);
      EXPECT_NE(HintFor(result.outcome), Hint::kNone);
    }
  }
}

MakeViews Rotating(const Eigen::Vector3d& rotation_deg, double focal_error) {
  return [=](SceneOptions options, Random* random) {
    options.focal_error = focal_error;
    return MakeTwoViews(Volume(2, 6), Motion({0, 0, 0}, rotation_deg), options, random);
  };
}

// An independently moving object has a ratio of the matches; the camera rotates by camera_deg but does not
// translate.
MakeViews MovingObject(double share, const Eigen::Vector3d& camera_deg, const Rigid3& motion) {
  return [=](const SceneOptions& options, Random* random) {
    const Rigid3 camera = Motion({0, 0, 0}, camera_deg);
    TwoViews views = MakeTwoViews(Volume(2, 6), camera, options, random);
    const TwoViews object = MakeTwoViews(OnPlane({0.1, 0.1, 1}, 1.2), camera * motion, options, random);
    for (std::size_t i = 0; i < views.correct.size(); ++i) {
      if (random->Uniform() >= share) continue;
      views.rays_in_a[i] = object.rays_in_a[i];
      views.rays_in_b[i] = object.rays_in_b[i];
    }
    return views;
  };
}

INSTANTIATE_TEST_SUITE_P(
    TwoViewGeometry, TwoViewsWithoutStructure,
    testing::Values(
        Case{"Still", Rotating({0, 0, 0}, 1)}, Case{"Rotation", Rotating({3, 10, 2}, 1)},
        Case{"LargeRotation", Rotating({2, 25, 1}, 1)},
        Case{"RotationWithAFocalLengthTwoPercentWrong", Rotating({1, 10, 3}, 1.02)},
        Case{"LargeRotationWithAFocalLengthThreePercentWrong", Rotating({5, 25, 3}, 1.03)},
        Case{"LittleParallax",
             [](const SceneOptions& o, Random* r) {
               return MakeTwoViews(Volume(2, 6), Motion({0.025, 0, 0}, 4 * RandomDirection(r)), o, r);
             }},
        Case{"OneFifthMoves", MovingObject(0.2, {0, 0, 0}, Motion({0.12, 0.05, 0}, {0, 0, 0}))},
        Case{"TwoFifthsMove", MovingObject(0.4, {0, 0, 0}, Motion({0.12, 0.05, 0}, {0, 0, 0}))},
        Case{"ThreeFifthsMoveAndRotate", MovingObject(0.6, {0, 0, 0}, Motion({0.12, 0.05, 0}, {0, 0, 15}))},
        Case{"FourFifthsMove", MovingObject(0.8, {0, 0, 0}, Motion({0.12, 0.05, 0}, {0, 0, 0}))},
        Case{"FourFifthsMoveAndRotate", MovingObject(0.8, {0, 0, 0}, Motion({0.12, 0.05, 0}, {0, 0, 15}))},
        Case{"HalfMovesWhileTheCameraRotates",
             MovingObject(0.5, {0, 6, 1}, Motion({0.12, 0.05, 0}, {5, -8, 8}))}),
    NameOf);

TEST(TwoViewGeometry, StillnessAndRotationAreClassifiedCorrectly) {
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed);
    const SceneOptions options{.count = 300, .noise_px = 0.5, .outlier_ratio = 0.2};
    EXPECT_EQ(EstimateFrom(Rotating({0, 0, 0}, 1)(options, &random), seed, 0.2).outcome,
              TwoViewOutcome::kStill);
    EXPECT_EQ(EstimateFrom(Rotating({2, 9, -3}, 1)(options, &random), seed, 0.2).outcome,
              TwoViewOutcome::kPureRotation);
  }
}

// When moving towards a slanted plane, both decompositions of the homography put every point in front of both
// cameras.
TEST(TwoViewGeometry, APlaneWithTwoDecompositionsIsRejectedAsAmbiguous) {
  int ambiguous = 0;
  for (const double outlier_ratio : {0.0, 0.3}) {
    for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
      Random random(seed);
      const TwoViews views =
          MakeTwoViews(OnPlane({0.5, 0, 0.85}, 1), Motion({-0.05, 0, 0.25}, 2 * RandomDirection(&random)),
                       {.count = 400, .noise_px = 0.5, .outlier_ratio = outlier_ratio}, &random);
      ambiguous += EstimateFrom(views, seed, outlier_ratio).outcome == TwoViewOutcome::kAmbiguousPlane;
    }
  }
  EXPECT_EQ(ambiguous, 2 * kSceneSeeds);
}

TEST(TwoViewGeometry, AFewPointsOffThePlaneResolveTheAmbiguity) {
  int right = 0, wrong = 0;
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed);
    const DepthAlong plane = OnPlane({0.5, 0, 0.85}, 1);
    const TwoViews views = MakeTwoViews(
        [=](const Eigen::Vector3d& ray, Random* r) {
          return plane(ray, r) * (r->Uniform() < 0.25 ? 0.6 : 1.0);
        },
        Motion({-0.05, 0, 0.25}, 2 * RandomDirection(&random)), {.count = 400, .noise_px = 0.5}, &random);
    const TwoViewResult result = EstimateFrom(views, seed, 0.3);
    if (!IsAccepted(result.outcome)) continue;
    (DirectionErrorDeg(result.b_from_a, views.b_from_a) < 5 ? right : wrong)++;
  }
  EXPECT_GE(right, kSceneSeeds - 2);
  EXPECT_EQ(wrong, 0);
}

TEST(TwoViewGeometry, WrongMatchesAloneAreInconsistent) {
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed);
    const TwoViews views = MakeTwoViews(Volume(2, 6), Motion({0.3, 0, 0}, {0, 0, 0}),
                                        {.count = 200, .outlier_ratio = 1}, &random);
    EXPECT_EQ(EstimateFrom(views, seed, 0).outcome, TwoViewOutcome::kInconsistent);
  }
}

TEST(TwoViewGeometry, AMovingMinorityDoesNotAffectTheMotionOfTheCamera) {
  for (std::uint64_t seed = 1; seed <= kSceneSeeds; ++seed) {
    Random random(seed);
    const SceneOptions options{.count = 400, .noise_px = 0.5};
    TwoViews views = MakeTwoViews(Volume(2, 6), Motion({0.35, 0.05, 0}, {1, 3, 0}), options, &random);
    const TwoViews object =
        MakeTwoViews(OnPlane({0, 0, 1}, 2), Motion({0.1, -0.4, 0.2}, {0, 0, 8}), options, &random);
    for (std::size_t i = 0; i < 80; ++i) {
      views.rays_in_a[i] = object.rays_in_a[i];
      views.rays_in_b[i] = object.rays_in_b[i];
    }
    const TwoViewResult result = EstimateFrom(views, seed, 0.2);
    ASSERT_EQ(result.outcome, TwoViewOutcome::kGeneral) << seed;
    EXPECT_LT(RotationErrorDeg(result.b_from_a, views.b_from_a), 0.4);
    EXPECT_LT(DirectionErrorDeg(result.b_from_a, views.b_from_a), 4);
    EXPECT_LE(std::count(result.inlier.begin(), result.inlier.begin() + 80, true), 12);
  }
}

TEST(TwoViewGeometry, TooFewOrUnusableMatchesAreRejected) {
  Random random(3);
  TwoViews views = MakeTwoViews(Volume(2, 6), Motion({0.4, 0, 0}, {0, 2, 0}), {.count = 60}, &random);
  EXPECT_EQ(EstimateTwoViews({}, {}, {}).outcome, TwoViewOutcome::kTooFewMatches);
  TwoViewOptions options;
  EXPECT_EQ(EstimateTwoViews(views.rays_in_a, views.rays_in_b, options).outcome, TwoViewOutcome::kGeneral);
  for (std::size_t i = 0; i < 15; ++i) {
    views.rays_in_a[i].setConstant(std::numeric_limits<double>::quiet_NaN());
    views.rays_in_b[i + 15].setZero();
  }
  EXPECT_EQ(EstimateTwoViews(views.rays_in_a, views.rays_in_b, options).outcome,
            TwoViewOutcome::kTooFewMatches);
  options.min_inliers = 25;
  const TwoViewResult result = EstimateTwoViews(views.rays_in_a, views.rays_in_b, options);
  EXPECT_EQ(result.outcome, TwoViewOutcome::kGeneral);
  ASSERT_EQ(result.inlier.size(), 60u);
  for (std::size_t i = 0; i < 30; ++i) EXPECT_FALSE(result.inlier[i]);
}

TEST(TwoViewGeometry, IsDeterministicUnderTheSeed) {
  Random random(4);
  const TwoViews views = MakeTwoViews(Volume(2, 6), Motion({0.3, 0, 0.1}, {0, 2, 1}),
                                      {.count = 300, .noise_px = 0.7, .outlier_ratio = 0.3}, &random);
  const TwoViewResult first = EstimateFrom(views, 9, 0.3), second = EstimateFrom(views, 9, 0.3);
  EXPECT_EQ(first.outcome, second.outcome);
  EXPECT_EQ(first.inlier, second.inlier);
  EXPECT_EQ(first.b_from_a.translation, second.b_from_a.translation);
  EXPECT_EQ(first.b_from_a.rotation.quaternion().coeffs(), second.b_from_a.rotation.quaternion().coeffs());
  EXPECT_TRUE(first.points_in_a == second.points_in_a);
}

}  // namespace
}  // namespace docent::engine
