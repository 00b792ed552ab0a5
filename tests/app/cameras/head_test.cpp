// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/head.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <map>
#include <numbers>

namespace docent::app {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// A device with these controls and nothing else; what is written stays written here.
struct FakeDevice {
  std::map<std::uint32_t, v4l2_queryctrl> controls;
  std::map<std::uint32_t, std::int32_t> written;
  int open = 0;

  void Add(std::uint32_t id, std::int32_t lowest, std::int32_t highest) {
    v4l2_queryctrl query{};
    query.id = id;
    query.minimum = lowest;
    query.maximum = highest;
    controls[id] = query;
  }
};

class FakeSystem : public DeviceSystem {
 public:
  explicit FakeSystem(FakeDevice* device) : device_(device) {}
  int Open(const std::string&) override {
    ++device_->open;
    return 3;
  }
  void Close(int) override { --device_->open; }
  int Control(int, unsigned long request, void* argument) override {
    if (request == VIDIOC_QUERYCTRL) {
      auto* query = static_cast<v4l2_queryctrl*>(argument);
      const auto found = device_->controls.find(query->id);
      if (found == device_->controls.end()) return Fail();
      *query = found->second;
      return 0;
    }
    if (request != VIDIOC_S_CTRL) return Fail();
    const auto* control = static_cast<v4l2_control*>(argument);
    if (!device_->controls.contains(control->id)) return Fail();
    device_->written[control->id] = control->value;
    return 0;
  }
  void* Map(int, std::size_t, long) override { return nullptr; }
  void Unmap(void*, std::size_t) override {}
  int Wait(int, int) override { return -1; }
  std::chrono::nanoseconds Now() override { return {}; }
  void Sleep(std::chrono::milliseconds) override {}

 private:
  static int Fail() {
    errno = EINVAL;
    return -1;
  }
  FakeDevice* const device_;
};

TEST(Head, LooksTowardWhatItIsToldTo) {
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0.2),
                                           Eigen::Vector3d(-0.4, -0.5, 0.8), Eigen::Vector3d(0.3, 0.4, -1)}) {
    const Eigen::Vector3d ahead = CarrierFromCamera(Toward(direction)) * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR((ahead - direction.normalized()).norm(), 0, 1e-12);
  }
  EXPECT_GT(Toward({1, 0, 1}).pan_rad, 0);    // to the right
  EXPECT_GT(Toward({0, -1, 1}).tilt_rad, 0);  // upwards
}

TEST(Head, TurnsAtItsSpeedAndNoFartherThanItCan) {
  HeadMotion motion({{-1, -0.5}, {1, 0.5}, 0.5});
  motion.LookAt({5, 0.25}, FromSeconds(10));
  EXPECT_DOUBLE_EQ(motion.target().pan_rad, 1);
  EXPECT_DOUBLE_EQ(motion.At(FromSeconds(10)).pan_rad, 0);
  EXPECT_NEAR(motion.At(FromSeconds(11)).pan_rad, 0.5, 1e-12);
  EXPECT_NEAR(motion.At(FromSeconds(11)).tilt_rad, 0.25, 1e-12);
  // Told otherwise on the way, it begins where it is.
  motion.LookAt({0, 0}, FromSeconds(11));
  EXPECT_NEAR(motion.At(FromSeconds(11.5)).pan_rad, 0.25, 1e-12);
  EXPECT_NEAR(motion.At(FromSeconds(20)).pan_rad, 0, 1e-12);
}

TEST(Head, OfADeviceTurnsInSecondsOfArc) {
  FakeDevice device;
  device.Add(V4L2_CID_PAN_ABSOLUTE, -100 * 3600, 100 * 3600);
  device.Add(V4L2_CID_TILT_ABSOLUTE, -20 * 3600, 20 * 3600);
  {
    const auto head = OpenDeviceHead(std::make_unique<FakeSystem>(&device), "/dev/video0");
    ASSERT_TRUE(head);
    EXPECT_NEAR(head->range().highest.pan_rad, 100 * kDegree, 1e-9);
    head->LookAt({30 * kDegree, -90 * kDegree}, FromSeconds(1));
    EXPECT_EQ(device.written[V4L2_CID_PAN_ABSOLUTE], 30 * 3600);
    EXPECT_EQ(device.written[V4L2_CID_TILT_ABSOLUTE], -20 * 3600);
    EXPECT_NEAR(head->At(FromSeconds(30)).pan_rad, 30 * kDegree, 1e-9);
  }
  EXPECT_EQ(device.open, 0);
}

TEST(Head, OfADeviceThatOnlyTurnsByStepsIsToldTheDifference) {
  FakeDevice device;
  device.Add(V4L2_CID_PAN_RELATIVE, -4480, 4480);
  const auto head = OpenDeviceHead(std::make_unique<FakeSystem>(&device), "/dev/video0");
  ASSERT_TRUE(head);
  head->LookAt({10 * kDegree, 0}, FromSeconds(1));
  EXPECT_EQ(device.written[V4L2_CID_PAN_RELATIVE], 640);
  head->LookAt({4 * kDegree, 0}, FromSeconds(2));
  EXPECT_EQ(device.written[V4L2_CID_PAN_RELATIVE], -384);
  EXPECT_DOUBLE_EQ(head->range().highest.tilt_rad, 0);
}

TEST(Head, IsNotThereOnADeviceWithoutPan) {
  FakeDevice device;
  EXPECT_FALSE(OpenDeviceHead(std::make_unique<FakeSystem>(&device), "/dev/video0"));
  EXPECT_EQ(device.open, 0);
}

}  // namespace
}  // namespace docent::app
