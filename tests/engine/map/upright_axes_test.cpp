// SPDX-License-Identifier: Apache-2.0
#include "engine/map/upright_axes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace docent::engine {
namespace {

MapSnapshot MapWithKeyFrames(const std::vector<Rotation3>& cameras_from_map) {
  MapSnapshot map;
  for (const Rotation3& rotation : cameras_from_map)
    map.keyframes.emplace_back().camera_from_map.rotation = rotation;
  return map;
}

TEST(UprightAxes, UpIsOppositeToTheMeanImageDownDirection) {
  const Rotation3 tilt = Rotation3::Exp({0.3, 0, 0});
  const MapSnapshot map =
      MapWithKeyFrames({Rotation3::Exp({-0.2, 0, 0}) * tilt, Rotation3::Exp({0.2, 0, 0}) * tilt});
  const Eigen::Vector3d expected = -(tilt.inverse() * Eigen::Vector3d::UnitY());
  EXPECT_LT((UpInMap(map) - expected).norm(), 1e-12);
}

TEST(UprightAxes, AreMinusYAndTheFirstViewWithoutTilt) {
  for (const MapSnapshot& map : {MapSnapshot(), MapWithKeyFrames({Rotation3()})}) {
    const UprightAxes axes = UprightAxesOf(map);
    EXPECT_LT((axes.up + Eigen::Vector3d::UnitY()).norm(), 1e-12);
    EXPECT_LT((axes.ahead - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_LT((axes.right - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  }
}

TEST(UprightAxes, AreOrthonormalAndRightHandedForAnyCameras) {
  const Rotation3 down = Rotation3::Exp({1.5707963267948966, 0, 0});
  for (const MapSnapshot& map :
       {MapWithKeyFrames({Rotation3::Exp({0.4, -1.1, 0.2}), Rotation3::Exp({-0.1, 0.5, 0.1})}),
        MapWithKeyFrames({down, Rotation3::Exp({0, 0.5, 0}) * down}),
        // The first camera looks straight up in a map whose other cameras are level.
        MapWithKeyFrames({down.inverse(), Rotation3(), down})}) {
    const UprightAxes axes = UprightAxesOf(map);
    Eigen::Matrix3d matrix;
    matrix << axes.right, axes.ahead, axes.up;
    EXPECT_LT((matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_GT(matrix.determinant(), 0);
    EXPECT_LT((axes.up - UpInMap(map)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace docent::engine
