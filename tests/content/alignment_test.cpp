// SPDX-License-Identifier: Apache-2.0
#include "content/alignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/random.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::HasSubstr;

Eigen::Vector3d InCube(Random* random) {
  return {random->Uniform(-1, 1), random->Uniform(-1, 1), random->Uniform(-1, 1)};
}

// Normal distribution (Box and Muller 1958).
double Normal(Random* random) {
  return std::sqrt(-2 * std::log(1 - random->Uniform())) * std::cos(2 * std::numbers::pi * random->Uniform());
}

engine::Sim3 AnyPose(Random* random) {
  return {engine::Rotation3::Exp(3 * InCube(random)), 10 * InCube(random), std::exp(random->Uniform(-3, 3))};
}

std::vector<Correspondence> Exact(const engine::Sim3& pose, int count, Random* random) {
  std::vector<Correspondence> pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d point = InCube(random);
    pairs.push_back({point, pose * point});
  }
  return pairs;
}

// The largest distance between two poses for points of the unit cube, relative to the scale.
double DistanceOf(const engine::Sim3& a, const engine::Sim3& b) {
  double most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d x((corner & 1) * 2 - 1, (corner & 2) - 1, (corner & 4) / 2 - 1);
    most = std::max(most, (a * x - b * x).norm() / b.scale);
  }
  return most;
}

TEST(AlignModel, RecoversAnExactSimilarityFromThreeAndMorePoints) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const engine::Sim3 truth = AnyPose(&random);
    const auto pairs = Exact(truth, 3 + static_cast<int>(random.Below(10)), &random);
    const Alignment alignment = AlignModel(pairs);
    EXPECT_LT(DistanceOf(alignment.map_from_model, truth), 1e-7) << trial;
    ASSERT_EQ(alignment.residuals.size(), pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_LT(alignment.residuals[i], 1e-7 * truth.scale);
      EXPECT_TRUE(alignment.inliers[i]);
    }
  }
}

TEST(AlignModel, AveragesTheNoiseOfManyPoints) {
  Random random(2);
  double few = 0, many = 0;
  constexpr int kTrials = 60;
  for (int trial = 0; trial < kTrials; ++trial) {
    const engine::Sim3 truth = AnyPose(&random);
    for (const int count : {6, 60}) {
      auto pairs = Exact(truth, count, &random);
      for (Correspondence& pair : pairs) {
        for (double& coordinate : pair.in_map) coordinate += 0.01 * truth.scale * Normal(&random);
      }
      (count == 6 ? few : many) += DistanceOf(AlignModel(pairs).map_from_model, truth) / kTrials;
    }
  }
  EXPECT_LT(few, 0.04);
  EXPECT_LT(many, 0.015);
  EXPECT_LT(many, 0.5 * few) << "the error falls with the square root of the number of points";
}

TEST(AlignModel, LeavesOutAsManyWrongPointsAsItPromises) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const engine::Sim3 truth = AnyPose(&random);
    const std::size_t count = 5 + random.Below(20), wrong = (count - 3) / 2;
    auto pairs = Exact(truth, static_cast<int>(count), &random);
    for (Correspondence& pair : pairs) {
      for (double& coordinate : pair.in_map) coordinate += 0.002 * truth.scale * Normal(&random);
    }
    for (std::size_t i = 0; i < wrong; ++i)
      pairs[i].in_map += truth.scale * (1 + random.Uniform()) * InCube(&random).normalized();
    const Alignment alignment = AlignModel(pairs);
    EXPECT_LT(DistanceOf(alignment.map_from_model, truth), 0.1) << trial << ": " << count << " points";
    for (std::size_t i = 0; i < wrong; ++i) {
      EXPECT_FALSE(alignment.inliers[i]) << trial;
      EXPECT_GT(alignment.residuals[i], 0.5 * truth.scale);
    }
  }
}

TEST(AlignModel, RefusesWhatDeterminesNoPose) {
  const auto refusal = [](const std::vector<Correspondence>& pairs) {
    return ErrorOf([&] { AlignModel(pairs); });
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        o = Eigen::Vector3d::Zero();
  EXPECT_THAT(refusal({}), HasSubstr("At least three"));
  EXPECT_THAT(refusal({{o, o}, {x, x}}), HasSubstr("At least three"));
  EXPECT_THAT(refusal({{o, o}, {o, x}, {o, y}}), HasSubstr("points of the model coincide"));
  EXPECT_THAT(refusal({{o, x}, {x, x}, {y, x}}), HasSubstr("points in the map coincide"));
  EXPECT_THAT(refusal({{o, o}, {x, x}, {2 * x, y}}), HasSubstr("of the model lie on one line"));
  EXPECT_THAT(refusal({{o, o}, {x, x}, {y, 3 * x}, {x + y, 2 * x}}), HasSubstr("in the map lie on one line"));
  EXPECT_THAT(refusal({{o, o}, {x, x}, {y, 5 * x + 1e-3 * y}}), HasSubstr("in the map lie on one line"));
  const Eigen::Vector3d nan = std::numeric_limits<double>::quiet_NaN() * x;
  EXPECT_THAT(refusal({{o, o}, {x, nan}, {y, y}}), HasSubstr("not finite"));
  // A square whose corners were given in the wrong order.
  EXPECT_THAT(refusal({{o, o}, {x, x + y}, {x + y, x}, {y, y}}), HasSubstr("No pose brings the points"));
  EXPECT_EQ(refusal({{o, o}, {x, x}, {x + y, x + y}, {y, y}}), "");
}

}  // namespace
}  // namespace docent::content
