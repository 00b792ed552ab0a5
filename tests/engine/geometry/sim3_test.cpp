// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/sim3.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/engine/geometry/transform_laws.h"

namespace docent::engine {
namespace {

Sim3 RandomSim3(Random* random) {
  Sim3 result;
  result.rotation = Rotation3::Exp(random->Uniform(0, 3.1) * RandomDirection(random));
  result.translation = RandomVector(random, 4);
  result.scale = std::exp(random->Uniform(-1.5, 1.5));
  return result;
}

std::vector<Eigen::Vector3d> Transformed(const Sim3& a_from_b, const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> result;
  for (const Eigen::Vector3d& point : points) {
    result.push_back(a_from_b * point);
  }
  return result;
}

double SquaredError(const Sim3& a_from_b, const std::vector<Eigen::Vector3d>& a,
                    const std::vector<Eigen::Vector3d>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (a[i] - a_from_b * b[i]).squaredNorm();
  }
  return sum;
}

TEST(Sim3Test, SatisfiesTheGroupLaws) {
  Random random(1);
  std::vector<Sim3> samples = {Sim3()};
  for (int i = 0; i < 30; ++i) {
    samples.push_back(RandomSim3(&random));
  }
  ExpectGroupLaws(samples, 1e-12);
}

TEST(AlignSim3Test, FindsTheExactSimilarity) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Sim3 a_from_b = RandomSim3(&random);
    std::vector<Eigen::Vector3d> b;
    for (int i = 0; i < 3 + trial; ++i) {
      b.push_back(RandomVector(&random, 2));
    }
    const auto found = AlignSim3(Transformed(a_from_b, b), b);
    ASSERT_TRUE(found);
    EXPECT_LT(Difference(*found, a_from_b), 1e-10) << *found << " instead of " << a_from_b;
  }
}

TEST(AlignSim3Test, AlignsPlanarCloudsWithoutMirroringThem) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Sim3 a_from_b = RandomSim3(&random);
    std::vector<Eigen::Vector3d> b;
    for (int i = 0; i < 10; ++i) {
      b.emplace_back(random.Uniform(-1, 1), random.Uniform(-1, 1), 0);
    }
    const auto found = AlignSim3(Transformed(a_from_b, b), b);
    ASSERT_TRUE(found);
    EXPECT_LT(Difference(*found, a_from_b), 1e-10);
  }
}

TEST(AlignSim3Test, ReturnsAProperRotationForAMirroredCloud) {
  Random random(4);
  std::vector<Eigen::Vector3d> a, b;
  for (int i = 0; i < 20; ++i) {
    b.push_back(RandomVector(&random, 1));
    a.emplace_back(b.back().x(), b.back().y(), -0.1 * b.back().z());
  }
  const auto found = AlignSim3(a, b);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation.matrix().determinant(), 1.0, 1e-12);
}

TEST(AlignSim3Test, IsALocalOptimumForNoisyPoints) {
  Random random(5);
  for (const bool fixed_scale : {false, true}) {
    Sim3 a_from_b = RandomSim3(&random);
    if (fixed_scale) {
      a_from_b.scale = 1;
    }
    std::vector<Eigen::Vector3d> b;
    for (int i = 0; i < 40; ++i) {
      b.push_back(RandomVector(&random, 2));
    }
    std::vector<Eigen::Vector3d> a = Transformed(a_from_b, b);
    for (Eigen::Vector3d& point : a) {
      point += RandomVector(&random, 0.1);
    }
    const auto found = AlignSim3(a, b, fixed_scale);
    ASSERT_TRUE(found);
    const double error = SquaredError(*found, a, b);
    for (int i = 0; i < 200; ++i) {
      Sim3 neighbour = *found;
      neighbour.rotation = Rotation3::Exp(RandomVector(&random, 1e-3)) * neighbour.rotation;
      neighbour.translation += RandomVector(&random, 1e-3);
      if (!fixed_scale) {
        neighbour.scale *= 1 + random.Uniform(-1e-3, 1e-3);
      }
      EXPECT_GT(SquaredError(neighbour, a, b), error);
    }
  }
}

TEST(AlignSim3Test, KeepsAFixedScaleAtOne) {
  Random random(6);
  Sim3 a_from_b = RandomSim3(&random);
  a_from_b.scale = 3;
  std::vector<Eigen::Vector3d> b;
  for (int i = 0; i < 30; ++i) {
    b.push_back(RandomVector(&random, 2));
  }
  const auto found = AlignSim3(Transformed(a_from_b, b), b, true);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->scale, 1.0);
  EXPECT_LT((found->rotation.inverse() * a_from_b.rotation).Angle(), 1e-10);
}

TEST(AlignSim3Test, RejectsDegenerateAndNonFiniteInput) {
  const std::vector<Eigen::Vector3d> two = {{0, 0, 0}, {1, 0, 0}};
  const std::vector<Eigen::Vector3d> line = {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}, {7, 8, 9}};
  const std::vector<Eigen::Vector3d> same = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  const std::vector<Eigen::Vector3d> spread = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  EXPECT_FALSE(AlignSim3(two, two));
  EXPECT_FALSE(AlignSim3(line, line));
  EXPECT_FALSE(AlignSim3(spread, line));
  EXPECT_FALSE(AlignSim3(line, spread));
  EXPECT_FALSE(AlignSim3(same, same));
  EXPECT_FALSE(AlignSim3(two, spread));
  std::vector<Eigen::Vector3d> broken = spread;
  broken[2].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(AlignSim3(broken, spread));
}

}  // namespace
}  // namespace docent::engine
