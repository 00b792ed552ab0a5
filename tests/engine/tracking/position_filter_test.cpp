// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/position_filter.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "tests/engine/geometry/test_math.h"

namespace docent::engine {
namespace {

constexpr double kDepth = 2;  // metres
const Eigen::Vector3d kVelocity(0.3, -0.1, 0.2);

Timestamp ImageTime(int image) {
  return FromSeconds(image / 30.0);
}

Eigen::Vector3d CenterAt(int image) {
  return Eigen::Vector3d(1, 2, 3) + image / 30.0 * kVelocity;
}

// After this many images with a constant velocity, whose positions are known to this standard deviation.
PositionFilter Walked(int images, double sigma_m) {
  PositionFilter filter;
  for (int i = 0; i < images; ++i) filter.Add(ImageTime(i), CenterAt(i), sigma_m, kDepth, false);
  return filter;
}

TEST(PositionFilter, PredictsNothingBeforeTheFirstPoseAndAfterAReset) {
  PositionFilter filter;
  EXPECT_FALSE(filter.Predict(ImageTime(0), kDepth));
  filter = Walked(3, 0.01);
  EXPECT_TRUE(filter.Predict(ImageTime(3), kDepth));
  filter.Reset();
  EXPECT_FALSE(filter.Predict(ImageTime(3), kDepth));
}

TEST(PositionFilter, PredictsAConstantVelocity) {
  const PositionFilter filter = Walked(60, 0.005);
  for (const int later : {0, 1, 5}) {
    const auto predicted = filter.Predict(ImageTime(60 + later), kDepth);
    ASSERT_TRUE(predicted);
    EXPECT_LT((predicted->center - CenterAt(60 + later)).norm(), 1e-3) << later;
  }
}

TEST(PositionFilter, IsLessCertainWithEachImageThatItPredicts) {
  const PositionFilter filter = Walked(60, 0.005);
  double last_m = 0;
  for (int later = 0; later < 30; ++later) {
    const double sigma_m = filter.Predict(ImageTime(60 + later), kDepth)->sigma;
    EXPECT_GT(sigma_m, last_m);
    last_m = sigma_m;
  }
  // An acceleration of half a median depth per square second: 9 cm after 0.6 s.
  EXPECT_GT(last_m, 0.1);
  EXPECT_LT(last_m, 0.5);
}

TEST(PositionFilter, IsUncertainWhileTheVelocityIsUnknown) {
  PositionFilter filter;
  filter.Add(ImageTime(0), CenterAt(0), 0.001, kDepth, false);
  EXPECT_GT(filter.Predict(ImageTime(3), kDepth)->sigma, 0.15) << "a person takes a step of 20 cm in 0.1 s";
}

TEST(PositionFilter, HardlyFollowsPositionsThatPointsDeterminePoorly) {
  PositionFilter filter = Walked(60, 0.005);
  const Eigen::Vector3d jump(0.4, 0, 0);
  for (int i = 60; i < 66; ++i) filter.Add(ImageTime(i), CenterAt(i) + jump, 0.4, kDepth, false);
  EXPECT_LT((filter.Predict(ImageTime(66), kDepth)->center - CenterAt(66)).norm(), 0.1);
}

TEST(PositionFilter, TakesAnEstimateThatContainsThePredictionAsItIs) {
  PositionFilter filter = Walked(60, 0.005);
  const Eigen::Vector3d center = CenterAt(60) + Eigen::Vector3d(0.01, 0, 0);
  filter.Add(ImageTime(60), center, 0.1, kDepth, true);
  EXPECT_LT((filter.Predict(ImageTime(60), kDepth)->center - center).norm(), 1e-12);
}

TEST(PositionFilter, SigmaMatchesTheErrors) {
  Random random(7);
  double squared = 0, expected = 0;
  constexpr double kSigma = 0.02;  // metres
  for (int trial = 0; trial < 300; ++trial) {
    PositionFilter filter;
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector2d noise = kSigma * RandomNormals(&random);
      filter.Add(ImageTime(i), CenterAt(i) + Eigen::Vector3d(noise.x(), noise.y(), 0), kSigma, kDepth, false);
    }
    const auto predicted = filter.Predict(ImageTime(59), kDepth);
    squared += (predicted->center - CenterAt(59)).head<2>().squaredNorm() / 2;
    expected += predicted->sigma * predicted->sigma;
  }
  // The camera does not accelerate here, so that the true errors are a little smaller.
  EXPECT_LT(squared, expected);
  EXPECT_GT(squared, 0.5 * expected);
}

TEST(PositionFilter, MovesAndScalesWithItsPartOfTheMap) {
  PositionFilter filter = Walked(60, 0.005);
  const auto before = filter.Predict(ImageTime(63), kDepth);
  const Sim3 correction{Rotation3::Exp({0, 0, 0.3}), {1, -2, 0.5}, 1.5};
  filter.ApplyCorrection(correction);
  const auto after = filter.Predict(ImageTime(63), 1.5 * kDepth);
  EXPECT_LT((after->center - correction * before->center).norm(), 1e-9);
  EXPECT_NEAR(after->sigma, 1.5 * before->sigma, 1e-9);
}

}  // namespace
}  // namespace docent::engine
