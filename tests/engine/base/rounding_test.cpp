// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "engine/base/random.h"

namespace docent {
namespace {

// A plane rotation as the eigenvalue solvers write it: a sum and a difference of products, which an optimizer
// could contract to fused multiply-add instructions.
[[gnu::noinline]] void Rotate(double cosine, double sine, const double* from, double* to) {
  const double x = from[0], y = from[1];
  to[0] = cosine * x - sine * y;
  to[1] = cosine * y + sine * x;
}

double Rounded(double a, double b) {
  const volatile double product = a * b;  // storing it in memory rounds it to double precision
  return product;
}

// A fused multiply-add would be more exact, but its result would differ between builds.
TEST(Products, AreRoundedBeforeTheyAreAdded) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const double cosine = random.Uniform(-1, 1), sine = random.Uniform(-1, 1);
    const double from[2] = {random.Uniform(-1, 1), random.Uniform(-1, 1)};
    double to[2];
    Rotate(cosine, sine, from, to);
    EXPECT_EQ(to[0], Rounded(cosine, from[0]) - Rounded(sine, from[1]));
    EXPECT_EQ(to[1], Rounded(cosine, from[1]) + Rounded(sine, from[0]));
  }
}

}  // namespace
}  // namespace docent
