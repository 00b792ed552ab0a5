// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/display_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/app/support/temporary_folder.h"
#include "tests/support/error_of.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;

constexpr const char* kDisplay = R"(width: 1280
height: 720
left: [1400, 1410, 650, 350]
right: [1400, 1410, 630, 350]
left_position: [-0.04, 0.02, -0.01]
right_position: [0.024, 0.02, -0.01]
right_rotation: [0, 90, 0]
)";

TEST(DisplayCalibration, IsReadForBothEyes) {
  const TemporaryFolder folder;
  folder.Write("display.yaml", kDisplay);
  const DisplayCalibration display = ReadDisplayCalibration(folder / "display.yaml");
  EXPECT_EQ(display.eyes[0].camera.width_px(), 1280);
  EXPECT_EQ(display.eyes[0].camera.intrinsics().cx, 650);
  EXPECT_EQ(display.eyes[1].camera.intrinsics().cx, 630);
  // An eye sees itself at its origin, and what is ahead of the camera ahead, if it is not turned.
  EXPECT_LT((display.eyes[0].eye_from_camera * Eigen::Vector3d(-0.04, 0.02, -0.01)).norm(), 1e-12);
  EXPECT_LT((display.eyes[0].eye_from_camera * Eigen::Vector3d(-0.04, 0.02, 0.99) - Eigen::Vector3d(0, 0, 1))
                .norm(),
            1e-12);
  // Turned by 90 degrees about y (down), the eye looks along the camera's x axis (right).
  const Eigen::Vector3d seen = display.eyes[1].eye_from_camera * Eigen::Vector3d(1.024, 0.02, -0.01);
  EXPECT_LT((seen - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
}

TEST(DisplayCalibration, FaultsAreNamedInOneSentence) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& from, const std::string& to) {
    std::string text = kDisplay;
    text.replace(text.find(from), from.size(), to);
    folder.Write("display.yaml", text);
    return ErrorOf([&] { ReadDisplayCalibration(folder / "display.yaml"); });
  };
  EXPECT_THAT(error("left: [1400, 1410, 650, 350]", "left: [1400, 1410]"),
              HasSubstr("'left' has 2 numbers instead of 4"));
  EXPECT_THAT(error("left_position: [-0.04, 0.02, -0.01]\n", ""), HasSubstr("left_position"));
  EXPECT_THAT(error("-0.04, 0.02", "-40, 0.02"), HasSubstr("more than a metre"));
  EXPECT_THAT(error("width: 1280", "width: 0"),
              AllOf(HasSubstr("does not describe a display"), EndsWith("pixels.")));
  EXPECT_THAT(error("0, 90, 0", "0, .nan, 0"), HasSubstr("right_rotation"));
  EXPECT_THAT(error("0, 90, 0", "0, 361, 0"),
              AllOf(HasSubstr("right_rotation"), HasSubstr("more than 360 degrees")));
  EXPECT_THAT(error("0, 90, 0", "0, 1e200, 0"), HasSubstr("more than 360 degrees"));
}

}  // namespace
}  // namespace docent::app
