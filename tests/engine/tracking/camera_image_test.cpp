// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/camera_image.h"

#include <gtest/gtest.h>

#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::ImageAt;

TEST(CameraImage, HasNoRotationWithoutAPreviousImage) {
  EXPECT_FALSE(ImageAt(CameraAt({0, 0, 0})).RotationFromPrevious());
}

TEST(CameraImage, GivesTheRotationSinceThePreviousImage) {
  const Rigid3 before = CameraAt({0, 0, 0}), now = CameraAt({0, 0, 0}, {0, 3, 0});
  CameraImage image = ImageAt(now, 1);
  image.previous = ImageAt(before).features;
  const auto rotation = image.RotationFromPrevious();
  ASSERT_TRUE(rotation);
  EXPECT_LT((*rotation * (now.rotation * before.rotation.inverse()).inverse()).Angle(), 0.005);
}

}  // namespace
}  // namespace docent::engine
