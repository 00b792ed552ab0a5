// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/head.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <limits>
#include <map>
#include <vector>

#include "tests/app/support/rad_per_degree.h"

namespace docent::app {
namespace {

// A device with these controls only, which behaves as V4L2 specifies for drivers (VIDIOC_G_CTRL,
// VIDIOC_S_CTRL): values are rounded to the control's steps and returned. A value out of range gives ERANGE,
// a missing control EINVAL, a control that another program holds EBUSY, and every call ENODEV while the
// device is unplugged.
struct FakeHeadDevice {
  std::map<std::uint32_t, v4l2_queryctrl> controls;
  std::map<std::uint32_t, std::int32_t> values;
  std::vector<std::pair<std::uint32_t, std::int32_t>> written;  // as requested, before rounding
  int open = 0;
  bool unplugged = false;
  int control_error = 0;  // error code of every S_CTRL; 0 if it succeeds

  void Add(std::uint32_t id, std::int32_t lowest, std::int32_t highest, std::int32_t step = 1) {
    v4l2_queryctrl query{};
    query.id = id;
    query.minimum = lowest;
    query.maximum = highest;
    query.step = step;
    controls[id] = query;
  }
  std::int32_t Last(std::uint32_t id) const {
    std::int32_t last = std::numeric_limits<std::int32_t>::min();
    for (const auto& [written_id, value] : written) {
      if (written_id == id) last = value;
    }
    return last;
  }
};

class HeadControlSystem : public DeviceSystem {
 public:
  explicit HeadControlSystem(FakeHeadDevice* device) : device_(device) {}
  int Open(const std::string&) override {
    if (device_->unplugged) return Fail(ENOENT);
    ++device_->open;
    return 3;
  }
  void Close(int) override { --device_->open; }
  int Control(int, unsigned long request, void* argument) override {
    if (device_->unplugged) return Fail(ENODEV);
    if (request == VIDIOC_QUERYCTRL) {
      auto* query = static_cast<v4l2_queryctrl*>(argument);
      const auto found = device_->controls.find(query->id);
      if (found == device_->controls.end()) return Fail(EINVAL);
      *query = found->second;
      return 0;
    }
    auto* control = static_cast<v4l2_control*>(argument);
    const auto found = device_->controls.find(control->id);
    if (found == device_->controls.end()) return Fail(EINVAL);
    if (request == VIDIOC_G_CTRL) {
      control->value = device_->values[control->id];
      return 0;
    }
    if (request != VIDIOC_S_CTRL) return Fail(ENOTTY);
    if (device_->control_error != 0) return Fail(device_->control_error);
    const v4l2_queryctrl& query = found->second;
    if (control->value < query.minimum || control->value > query.maximum) return Fail(ERANGE);
    device_->written.emplace_back(control->id, control->value);
    control->value = query.minimum + (control->value - query.minimum) / query.step * query.step;
    device_->values[control->id] = control->value;
    return 0;
  }
  void* Map(int, std::size_t, long) override { return nullptr; }
  void Unmap(void*, std::size_t) override {}
  int Wait(int, int) override { return -1; }
  std::chrono::nanoseconds Now() override { return {}; }
  void Sleep(std::chrono::milliseconds) override {}

 private:
  static int Fail(int error) {
    errno = error;
    return -1;
  }
  FakeHeadDevice* const device_;
};

TEST(Head, TurnsTowardsTheGivenDirection) {
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0.2),
                                           Eigen::Vector3d(-0.4, -0.5, 0.8), Eigen::Vector3d(0.3, 0.4, -1)}) {
    const Eigen::Vector3d ahead = CarrierFromCamera(Toward(direction)) * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR((ahead - direction.normalized()).norm(), 0, 1e-12);
  }
  EXPECT_GT(Toward({1, 0, 1}).pan_rad, 0);    // to the right
  EXPECT_GT(Toward({0, -1, 1}).tilt_rad, 0);  // upwards
}

TEST(Head, TurnsAtItsSpeedWithinItsRange) {
  HeadMotion motion({{-1, -0.5}, {1, 0.5}, 0.5});
  motion.LookAt({5, 0.25}, FromSeconds(10));
  EXPECT_DOUBLE_EQ(motion.target().pan_rad, 1);
  EXPECT_DOUBLE_EQ(motion.At(FromSeconds(10)).pan_rad, 0);
  EXPECT_NEAR(motion.At(FromSeconds(11)).pan_rad, 0.5, 1e-12);
  EXPECT_NEAR(motion.At(FromSeconds(11)).tilt_rad, 0.25, 1e-12);
  // A new target during a motion starts from the current angles.
  motion.LookAt({0, 0}, FromSeconds(11));
  EXPECT_NEAR(motion.At(FromSeconds(11.5)).pan_rad, 0.25, 1e-12);
  EXPECT_NEAR(motion.At(FromSeconds(20)).pan_rad, 0, 1e-12);
}

TEST(Head, UsesArcSecondsOfADevice) {
  FakeHeadDevice device;
  device.Add(V4L2_CID_PAN_ABSOLUTE, -100 * 3600, 100 * 3600);
  device.Add(V4L2_CID_TILT_ABSOLUTE, -20 * 3600, 20 * 3600);
  {
    const auto head = OpenDeviceHead(std::make_unique<HeadControlSystem>(&device), "/dev/video0");
    ASSERT_TRUE(head);
    EXPECT_NEAR(head->range().highest.pan_rad, 100 * kRadPerDegree, 1e-9);
    head->LookAt({30 * kRadPerDegree, -90 * kRadPerDegree}, FromSeconds(1));
    EXPECT_EQ(device.Last(V4L2_CID_PAN_ABSOLUTE), 30 * 3600);
    EXPECT_EQ(device.Last(V4L2_CID_TILT_ABSOLUTE), -20 * 3600);
    EXPECT_NEAR(head->At(FromSeconds(30)).pan_rad, 30 * kRadPerDegree, 1e-9);
  }
  EXPECT_EQ(device.open, 0);
}

TEST(Head, SendsDifferencesToADeviceWithRelativeControls) {
  FakeHeadDevice device;
  device.Add(V4L2_CID_PAN_RELATIVE, -4480, 4480);
  const auto head = OpenDeviceHead(std::make_unique<HeadControlSystem>(&device), "/dev/video0");
  ASSERT_TRUE(head);
  head->LookAt({10 * kRadPerDegree, 0}, FromSeconds(1));
  EXPECT_EQ(device.Last(V4L2_CID_PAN_RELATIVE), 640);
  head->LookAt({4 * kRadPerDegree, 0}, FromSeconds(2));
  EXPECT_EQ(device.Last(V4L2_CID_PAN_RELATIVE), -384);
  EXPECT_DOUBLE_EQ(head->range().highest.tilt_rad, 0);
}

TEST(Head, RoundsToTheStepsOfADeviceAndStartsAtItsAngles) {
  FakeHeadDevice device;
  // Steps of a quarter of a degree from -50 degrees: other angles are rounded.
  device.Add(V4L2_CID_PAN_ABSOLUTE, -50 * 3600, 50 * 3600, 900);
  device.values[V4L2_CID_PAN_ABSOLUTE] = 45 * 3600;
  const auto head = OpenDeviceHead(std::make_unique<HeadControlSystem>(&device), "/dev/video0");
  ASSERT_TRUE(head);
  EXPECT_NEAR(head->At({}).pan_rad, 45 * kRadPerDegree, 1e-9) << "it has not turned to the centre yet";
  EXPECT_NEAR(head->At(FromSeconds(30)).pan_rad, 0, 1e-9);
  head->LookAt({20.2 * kRadPerDegree, 0}, FromSeconds(40));
  EXPECT_EQ(device.Last(V4L2_CID_PAN_ABSOLUTE), 20 * 3600 + 900);
  EXPECT_NEAR(head->At(FromSeconds(60)).pan_rad, 20.25 * kRadPerDegree, 1e-9);
  head->LookAt({-80 * kRadPerDegree, 0}, FromSeconds(60));
  EXPECT_EQ(device.Last(V4L2_CID_PAN_ABSOLUTE), -50 * 3600) << "must stay within the range";
}

TEST(Head, UsesTheValueThatTheDriverReturns) {
  FakeHeadDevice device;
  device.Add(V4L2_CID_PAN_ABSOLUTE, -360000, 360000, 1);
  auto system = std::make_unique<HeadControlSystem>(&device);
  const auto head = OpenDeviceHead(std::move(system), "/dev/video0");
  ASSERT_TRUE(head);
  // The firmware has coarser steps than its description.
  device.controls[V4L2_CID_PAN_ABSOLUTE].step = 10 * 3600;
  head->LookAt({37 * kRadPerDegree, 0}, FromSeconds(1));
  EXPECT_NEAR(head->At(FromSeconds(30)).pan_rad, 30 * kRadPerDegree, 1e-9);
}

TEST(Head, StaysWhileTheDeviceRejectsMotionAndMovesOnceItAccepts) {
  for (const int control_error : {EBUSY, EACCES, ERANGE, EINVAL}) {
    FakeHeadDevice device;
    device.Add(V4L2_CID_PAN_ABSOLUTE, -100 * 3600, 100 * 3600);
    const auto head = OpenDeviceHead(std::make_unique<HeadControlSystem>(&device), "/dev/video0");
    ASSERT_TRUE(head);
    device.control_error = control_error;
    head->LookAt({30 * kRadPerDegree, 0}, FromSeconds(1));
    EXPECT_NEAR(head->At(FromSeconds(30)).pan_rad, 0, 1e-9) << control_error;
    device.control_error = 0;
    head->LookAt({30 * kRadPerDegree, 0}, FromSeconds(30));
    EXPECT_NEAR(head->At(FromSeconds(60)).pan_rad, 30 * kRadPerDegree, 1e-9) << control_error;
    EXPECT_EQ(device.open, 1);
  }
}

TEST(Head, ReopensADeviceThatWasUnplugged) {
  FakeHeadDevice device;
  device.Add(V4L2_CID_PAN_ABSOLUTE, -100 * 3600, 100 * 3600);
  {
    const auto head = OpenDeviceHead(std::make_unique<HeadControlSystem>(&device), "/dev/video0");
    ASSERT_TRUE(head);
    head->LookAt({30 * kRadPerDegree, 0}, FromSeconds(1));
    device.unplugged = true;
    head->LookAt({-30 * kRadPerDegree, 0}, FromSeconds(10));
    EXPECT_EQ(device.open, 0) << "an unplugged device must be closed, so that it can get the same name again";
    EXPECT_NEAR(head->At(FromSeconds(20)).pan_rad, 30 * kRadPerDegree, 1e-9);
    head->LookAt({-30 * kRadPerDegree, 0}, FromSeconds(20));
    device.unplugged = false;
    device.values[V4L2_CID_PAN_ABSOLUTE] = 0;  // it restarts at zero
    head->LookAt({-30 * kRadPerDegree, 0}, FromSeconds(30));
    EXPECT_EQ(device.Last(V4L2_CID_PAN_ABSOLUTE), -30 * 3600);
    EXPECT_NEAR(head->At(FromSeconds(30)).pan_rad, 0, 1e-9);
    EXPECT_NEAR(head->At(FromSeconds(40)).pan_rad, -30 * kRadPerDegree, 1e-9);
    // If another camera without pan control takes its place, it is not opened.
    device.unplugged = true;
    head->LookAt({}, FromSeconds(50));
    device.unplugged = false;
    device.controls.clear();
    head->LookAt({}, FromSeconds(60));
    EXPECT_EQ(device.open, 0);
  }
  EXPECT_EQ(device.open, 0);
}

TEST(Head, DoesNotExistWithoutPanControl) {
  FakeHeadDevice device;
  EXPECT_FALSE(OpenDeviceHead(std::make_unique<HeadControlSystem>(&device), "/dev/video0"));
  EXPECT_EQ(device.open, 0);
}

}  // namespace
}  // namespace docent::app
