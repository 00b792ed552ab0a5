// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/readout_prior.h"

#include <gtest/gtest.h>

#include <array>

namespace docent::engine {
namespace {

std::optional<Eigen::Index> AxisOf(int width_px, int height_px) {
  return ReadoutAxis(CameraModel(LensModel::kRadialTangential, {width_px, height_px, 500, 500, 300, 300},
                                 std::array<double, 5>{}));
}

TEST(ReadoutAxis, FollowsTheShorterSideOfTheImage) {
  EXPECT_EQ(AxisOf(640, 480), 1) << "rows are exposed one after another";
  EXPECT_EQ(AxisOf(1280, 1024), 1);
  EXPECT_EQ(AxisOf(1080, 1920), 0) << "columns, of a phone that is held upright";
}

TEST(ReadoutAxis, IsUnknownInASquareImage) {
  EXPECT_FALSE(AxisOf(600, 600));
  EXPECT_FALSE(AxisOf(640, 600));
}

}  // namespace
}  // namespace docent::engine
