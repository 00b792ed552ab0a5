// SPDX-License-Identifier: Apache-2.0
#include "app/session/way_to_map.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"

namespace docent::app {

namespace {

// A map whose first keyframe with a position is at this place, after one without a position.
engine::MapSnapshot MapFrom(const Eigen::Vector3d& begin) {
  engine::MapSnapshot map;
  engine::KeyFrame keyframe;
  keyframe.kind = engine::KeyFrameKind::kPanorama;
  keyframe.camera_from_map = {{}, {9, 9, 9}};
  map.keyframes.push_back(keyframe);
  keyframe.kind = engine::KeyFrameKind::kSixDof;
  const engine::Rotation3 rotation = engine::Rotation3::Exp({0.3, -1, 0.2});
  keyframe.camera_from_map = {rotation, -(rotation * begin)};
  map.keyframes.push_back(keyframe);
  keyframe.camera_from_map = {};
  map.keyframes.push_back(keyframe);
  return map;
}

TEST(DirectionToMap, LeadsFromTheBoardToTheFirstPositionOfTheOtherMap) {
  Random random(7);
  for (int i = 0; i < 100; ++i) {
    const auto vector = [&] {
      return Eigen::Vector3d(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3));
    };
    content::Signpost sign;
    sign.anchor = vector();
    sign.up = vector().normalized();
    sign.height = 0.1;
    const engine::Sim3 a_from_b{engine::Rotation3::Exp(vector()), vector(), random.Uniform(0.2, 5)};
    const Eigen::Vector3d begin_in_a = vector();
    const auto direction = DirectionToMap(sign, a_from_b, MapFrom(a_from_b.inverse() * begin_in_a));
    const Eigen::Vector3d board =
        sign.anchor + 0.12 * sign.up;  // 0.7 of the board below it, 0.5 to its middle.
    if ((begin_in_a - board).norm() < 0.11) continue;
    ASSERT_TRUE(direction);
    EXPECT_LT((*direction - (begin_in_a - board).normalized()).norm(), 1e-9);
  }
}

TEST(DirectionToMap, IsNotKnownWithoutABeginningElsewhere) {
  content::Signpost sign;
  sign.height = 0.1;
  EXPECT_FALSE(DirectionToMap(sign, {}, engine::MapSnapshot()));
  EXPECT_FALSE(DirectionToMap(sign, {}, MapFrom(content::BoardMiddle(sign) + Eigen::Vector3d(0.05, 0, 0))));
  EXPECT_TRUE(DirectionToMap(sign, {}, MapFrom(content::BoardMiddle(sign) + Eigen::Vector3d(0.15, 0, 0))));
}

}  // namespace

}  // namespace docent::app
