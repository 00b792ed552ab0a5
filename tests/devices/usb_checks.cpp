// SPDX-License-Identifier: Apache-2.0
// Tests of the kernel's webcam driver, uvcvideo, with a camera that pans and tilts; see usb_camera.h.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <optional>

#include "app/cameras/device_source.h"
#include "app/cameras/head.h"
#include "tests/devices/usb_camera.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

CameraOptions Options() {
  CameraOptions options;
  options.device_format = {UsbCamera::kWidth_px, UsbCamera::kHeight_px, 0, 0};
  options.device_timeout = std::chrono::seconds(20);
  options.reconnect = true;
  return options;
}

TEST(Webcam, ListsPanAndTiltControls) {
  const UsbCamera camera;
  const std::string path = camera.Path();
  ASSERT_NE(path, "");
  const auto system = MakeDeviceSystem();
  const auto description = DescribeDevice(path, system.get());
  ASSERT_TRUE(description);
  EXPECT_EQ(description->driver, "uvcvideo");
  std::vector<std::string> names;
  for (const DeviceControl& control : description->controls) names.push_back(control.name);
  EXPECT_THAT(names, ::testing::IsSupersetOf({HasSubstr("Pan"), HasSubstr("Tilt")}));
}

TEST(Webcam, TurnsItsHeadToTheRequestedAngles) {
  const UsbCamera camera;
  const auto head = OpenDeviceHead(MakeDeviceSystem(), camera.Path());
  ASSERT_TRUE(head);
  EXPECT_NEAR(head->range().lowest.pan_rad, -100 * kDegree, 1e-9);
  EXPECT_NEAR(head->range().highest.tilt_rad, 100 * kDegree, 1e-9);
  head->LookAt({30 * kDegree, -12.4 * kDegree}, FromSeconds(1));
  EXPECT_EQ(camera.pan(), 30 * 3600);
  EXPECT_EQ(camera.tilt(), -12 * 3600 - 1800) << "its steps are half a degree";
  EXPECT_NEAR(head->At(FromSeconds(100)).tilt_rad, -12.5 * kDegree, 1e-9);
  head->LookAt({170 * kDegree, 0}, FromSeconds(100));
  EXPECT_EQ(camera.pan(), UsbCamera::kHighest);
  EXPECT_EQ(camera.tilt(), 0);
}

TEST(Webcam, KeepsItsHeadStillUntilTheDeviceIsReady) {
  UsbCamera camera;
  const auto head = OpenDeviceHead(MakeDeviceSystem(), camera.Path());
  ASSERT_TRUE(head);
  for (const std::uint8_t code : {1, 4}) {
    camera.RejectMotion(code);
    head->LookAt({20 * kDegree, 0}, FromSeconds(code));
    EXPECT_EQ(camera.pan(), 0);
    EXPECT_NEAR(head->At(FromSeconds(100)).pan_rad, 0, 1e-9);
    camera.RejectMotion(0);
    head->LookAt({20 * kDegree, 0}, FromSeconds(100 + code));
    EXPECT_EQ(camera.pan(), 20 * 3600);
    head->LookAt({}, FromSeconds(200));
  }
}

TEST(Webcam, ContinuesAndTurnsItsHeadAfterReconnection) {
  std::optional<UsbCamera> camera(std::in_place);
  const std::string path = camera->Path();
  ASSERT_NE(path, "");
  const auto source = OpenDevice(path, Options());
  source->SetHead(OpenDeviceHead(MakeDeviceSystem(), path));
  Head* const head = source->head();
  ASSERT_TRUE(head);
  engine::Frame frame;
  std::optional<Timestamp> before;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    ASSERT_EQ(frame.image.size(), cv::Size(UsbCamera::kWidth_px, UsbCamera::kHeight_px));
    if (before) {
      EXPECT_GT(frame.time, *before);
    }
    before = frame.time;
  }
  camera.reset();
  for (int i = 0; i < 20 && source->trouble().empty(); ++i) ASSERT_TRUE(source->Next(&frame));
  EXPECT_THAT(source->trouble(), HasSubstr("unplugged"));
  camera.emplace();
  ASSERT_EQ(camera->Path(), path) << "all users have closed it, so that it gets the same name";
  for (int i = 0; i < 50 && !source->trouble().empty(); ++i) ASSERT_TRUE(source->Next(&frame));
  EXPECT_EQ(source->trouble(), "");
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_FALSE(frame.image.empty());
  EXPECT_EQ(source->delivery().reconnections, 1);
  head->LookAt({20 * kDegree, 0}, FromSeconds(200));
  EXPECT_EQ(camera->pan(), 20 * 3600);
}

}  // namespace
}  // namespace docent::app
