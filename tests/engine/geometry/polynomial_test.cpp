// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/polynomial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

// The coefficients of the product of (x - root) over all roots.
std::vector<double> FromRoots(const std::vector<double>& roots) {
  std::vector<double> coefficients = {1};
  for (const double root : roots) {
    std::vector<double> product(coefficients.size() + 1, 0);
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      product[i + 1] += coefficients[i];
      product[i] -= root * coefficients[i];
    }
    coefficients = product;
  }
  return coefficients;
}

TEST(SignChangesTest, FindsExactlyTheRootsInsideTheInterval) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> roots, inside;
    for (int i = 0; i < 6; ++i) {
      // The roots are at least 0.3 apart, so that rounding cannot merge two of them.
      roots.push_back(-1.5 + i + random.Uniform(-0.35, 0.35));
      if (roots.back() > 0 && roots.back() < 3) {
        inside.push_back(roots.back());
      }
    }
    const std::vector<double> found = SignChanges(FromRoots(roots), 3);
    ASSERT_EQ(found.size(), inside.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i], inside[i], 1e-9);
    }
  }
}

TEST(SignChangesTest, FindsNoneWhereThePolynomialHasNoRoots) {
  EXPECT_TRUE(SignChanges({}, 10).empty());
  EXPECT_TRUE(SignChanges({3}, 10).empty());
  EXPECT_TRUE(SignChanges({1, 0, 1}, 10).empty());
  EXPECT_TRUE(SignChanges({1, 0, 0, 0}, 10).empty());
}

}  // namespace
}  // namespace docent::engine
