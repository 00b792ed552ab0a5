// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/head.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <utility>

#include "app/cameras/device_controls.h"

namespace docent::app {

namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
// Of a turning webcam; no control says it.
constexpr double kDeviceSpeed = 60 * kRadiansPerDegree;

double Approach(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

// One axis of a device.
struct Axis {
  std::uint32_t id = 0;
  bool absolute = false;
  double unit_rad = 0, lowest_rad = 0, highest_rad = 0;
};

std::optional<Axis> FindAxis(DeviceSystem* system, int file, std::uint32_t absolute, std::uint32_t relative) {
  // V4L2 counts absolute angles in seconds of arc, and leaves the unit of relative ones to the device; those
  // that turn by relative steps count 64 to a degree.
  constexpr double kArcSecond = kRadiansPerDegree / 3600, kStep = kRadiansPerDegree / 64;
  for (const std::uint32_t id : {absolute, relative}) {
    v4l2_queryctrl query{};
    query.id = id;
    if (system->Control(file, VIDIOC_QUERYCTRL, &query) < 0 || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0)
      continue;
    if (query.maximum <= query.minimum) continue;
    const double unit = id == absolute ? kArcSecond : kStep;
    Axis axis{id, id == absolute, unit, query.minimum * unit, query.maximum * unit};
    // Nobody turns farther than once around, whatever the driver says.
    axis.lowest_rad = std::max(axis.lowest_rad, -std::numbers::pi);
    axis.highest_rad = std::min(axis.highest_rad, std::numbers::pi);
    return axis;
  }
  return std::nullopt;
}

class DeviceHead : public Head {
 public:
  DeviceHead(std::unique_ptr<DeviceSystem> system, int file, const Axis& pan, const std::optional<Axis>& tilt)
      : system_(std::move(system)),
        file_(file),
        pan_(pan),
        tilt_(tilt),
        range_{{pan.lowest_rad, tilt ? tilt->lowest_rad : 0},
               {pan.highest_rad, tilt ? tilt->highest_rad : 0},
               kDeviceSpeed},
        motion_(range_) {}
  ~DeviceHead() override { system_->Close(file_); }

  const PanTiltRange& range() const override { return range_; }
  PanTilt At(Timestamp time) const override {
    const std::scoped_lock lock(mutex_);
    return motion_.At(time);
  }
  void LookAt(const PanTilt& wanted, Timestamp now) override {
    const std::scoped_lock lock(mutex_);
    const PanTilt to = range_.Clamped(wanted), from = motion_.target();
    const bool panned = Turn(pan_, from.pan_rad, to.pan_rad);
    const bool tilted = tilt_ && Turn(*tilt_, from.tilt_rad, to.tilt_rad);
    // An axis that refused stays where it is.
    motion_.LookAt({panned ? to.pan_rad : from.pan_rad, tilted ? to.tilt_rad : from.tilt_rad}, now);
  }

 private:
  bool Turn(const Axis& axis, double from_rad, double to_rad) {
    const double value = (axis.absolute ? to_rad : to_rad - from_rad) / axis.unit_rad;
    if (!axis.absolute && std::abs(value) < 0.5) return false;
    return WriteControl(system_.get(), file_, axis.id, std::llround(value));
  }

  const std::unique_ptr<DeviceSystem> system_;
  const int file_;
  const Axis pan_;
  const std::optional<Axis> tilt_;
  const PanTiltRange range_;
  mutable std::mutex mutex_;
  HeadMotion motion_;
};

}  // namespace

PanTilt PanTiltRange::Clamped(const PanTilt& wanted) const {
  return {std::clamp(wanted.pan_rad, lowest.pan_rad, highest.pan_rad),
          std::clamp(wanted.tilt_rad, lowest.tilt_rad, highest.tilt_rad)};
}

double PanTiltRange::TravelSeconds(const PanTilt& from, const PanTilt& to) const {
  return std::max(std::abs(to.pan_rad - from.pan_rad), std::abs(to.tilt_rad - from.tilt_rad)) /
         speed_rad_per_s;
}

engine::Rotation3 CarrierFromCamera(const PanTilt& at) {
  return engine::Rotation3::Exp({0, at.pan_rad, 0}) * engine::Rotation3::Exp({at.tilt_rad, 0, 0});
}

PanTilt Toward(const Eigen::Vector3d& direction) {
  return {std::atan2(direction.x(), direction.z()),
          std::atan2(-direction.y(), std::hypot(direction.x(), direction.z()))};
}

void HeadMotion::LookAt(const PanTilt& wanted, Timestamp now) {
  start_ = At(now);
  begin_ = now;
  target_ = range_.Clamped(wanted);
}

PanTilt HeadMotion::At(Timestamp time) const {
  const double most = range_.speed_rad_per_s * std::max(0.0, ToSeconds(time - begin_));
  return {Approach(start_.pan_rad, target_.pan_rad, most), Approach(start_.tilt_rad, target_.tilt_rad, most)};
}

std::unique_ptr<Head> OpenDeviceHead(std::unique_ptr<DeviceSystem> system, const std::string& path) {
  const int file = system->Open(path);
  if (file < 0) return nullptr;
  const auto pan = FindAxis(system.get(), file, V4L2_CID_PAN_ABSOLUTE, V4L2_CID_PAN_RELATIVE);
  const auto tilt = FindAxis(system.get(), file, V4L2_CID_TILT_ABSOLUTE, V4L2_CID_TILT_RELATIVE);
  if (!pan) {
    system->Close(file);
    return nullptr;
  }
  if (!pan->absolute) WriteControl(system.get(), file, V4L2_CID_PAN_RESET, 1);
  if (tilt && !tilt->absolute) WriteControl(system.get(), file, V4L2_CID_TILT_RESET, 1);
  auto head = std::make_unique<DeviceHead>(std::move(system), file, *pan, tilt);
  head->LookAt({}, {});
  return head;
}

}  // namespace docent::app
