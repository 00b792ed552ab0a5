// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/skyline_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "tests/engine/geometry/test_math.h"

namespace docent::engine {
namespace {

constexpr int kBlock = SkylineCholesky::kBlock;
using CholeskyOutcome = SkylineCholesky::Outcome;

bool Never() {
  return false;
}

struct LinearSystem {
  std::vector<int> first;
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right_side;
};

// J^T J of random rows that each involve a few neighbouring blocks, as a point involves the cameras that see
// it; with `revisit` the last block shares rows with the first.
LinearSystem MakeSystem(int blocks, int reach, bool revisit, std::uint64_t seed) {
  Random random(seed);
  LinearSystem system;
  system.matrix = Eigen::MatrixXd::Identity(kBlock * blocks, kBlock * blocks);
  system.right_side = Eigen::VectorXd::NullaryExpr(kBlock * blocks, [&] { return RandomNormal(&random); });
  for (int i = 0; i < blocks; ++i) system.first.push_back(i);
  const auto couple = [&](int begin, int end) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(kBlock * blocks);
    for (const int block : {begin, end})
      for (int i = 0; i < kBlock; ++i) row[kBlock * block + i] = RandomNormal(&random);
    system.matrix += row * row.transpose();
    int& first = system.first[static_cast<std::size_t>(end)];
    first = std::min(first, begin);
  };
  for (int i = 0; i < blocks; ++i)
    for (int j = i; j < std::min(blocks, i + reach); ++j) couple(i, j);
  if (revisit) couple(0, blocks - 1);
  return system;
}

SkylineCholesky Fill(const LinearSystem& system) {
  SkylineCholesky result(system.first);
  result.SetZero();
  for (int row = 0; row < result.rows(); ++row) {
    for (int column = system.first[static_cast<std::size_t>(row)]; column <= row; ++column)
      result.At(row, column) = system.matrix.block<kBlock, kBlock>(kBlock * row, kBlock * column);
  }
  return result;
}

TEST(SkylineCholesky, AgreesWithADenseFactorization) {
  for (const int blocks : {1, 2, 7, 8, 9, 16, 23, 40}) {
    for (const int reach : {1, 3, 12, 40}) {
      for (const bool revisit : {false, true}) {
        const LinearSystem system =
            MakeSystem(blocks, reach, revisit, static_cast<std::uint64_t>(blocks + reach));
        SkylineCholesky skyline = Fill(system);
        ASSERT_EQ(skyline.Factor(Never), CholeskyOutcome::kDone);
        Eigen::VectorXd found = system.right_side;
        skyline.Solve(&found);
        const Eigen::VectorXd expected = system.matrix.llt().solve(system.right_side);
        EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm()) << blocks << ' ' << reach;
      }
    }
  }
}

TEST(SkylineCholesky, ReadsTheLowerTriangleOfItsDiagonalBlocksOnly) {
  const LinearSystem system = MakeSystem(10, 4, false, 3);
  SkylineCholesky skyline = Fill(system);
  for (int i = 0; i < 10; ++i) skyline.At(i, i).triangularView<Eigen::StrictlyUpper>().setConstant(1e9);
  ASSERT_EQ(skyline.Factor(Never), CholeskyOutcome::kDone);
  Eigen::VectorXd found = system.right_side;
  skyline.Solve(&found);
  EXPECT_LT((system.matrix * found - system.right_side).norm(), 1e-9 * system.right_side.norm());
}

TEST(SkylineCholesky, AcceptsAnEmptyMatrix) {
  SkylineCholesky skyline((std::vector<int>()));
  EXPECT_EQ(skyline.Factor(Never), CholeskyOutcome::kDone);
  Eigen::VectorXd nothing(0);
  skyline.Solve(&nothing);
  EXPECT_EQ(skyline.rows(), 0);
}

TEST(SkylineCholesky, ReportsThatAMatrixIsNotPositiveDefinite) {
  LinearSystem system = MakeSystem(20, 3, false, 4);
  system.matrix(100, 100) = -1;
  SkylineCholesky skyline = Fill(system);
  EXPECT_EQ(skyline.Factor(Never), CholeskyOutcome::kNotPositive);
}

TEST(SkylineCholesky, StopsWhenInterrupted) {
  const LinearSystem system = MakeSystem(64, 64, false, 5);
  SkylineCholesky skyline = Fill(system);
  int questions = 0;
  EXPECT_EQ(skyline.Factor([&] { return ++questions == 5; }), CholeskyOutcome::kInterrupted);
  EXPECT_EQ(questions, 5);
}

TEST(SkylineCholesky, StoresNothingLeftOfTheFirstBlocks) {
  std::vector<int> band, full;
  for (int i = 0; i < 1000; ++i) {
    band.push_back(std::max(0, i - 20));
    full.push_back(0);
  }
  const SkylineCholesky narrow(band), wide(full);
  EXPECT_LT(narrow.bytes() * 10, wide.bytes());
  band.back() = 0;  // one place seen again
  EXPECT_LT(SkylineCholesky(band).bytes(), narrow.bytes() * 3 / 2);
}

}  // namespace
}  // namespace docent::engine
