// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/head.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <utility>

#include "app/cameras/device_controls.h"

namespace docent::app {

namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
// Typical speed of a pan-tilt webcam; no V4L2 control reports it.
constexpr double kDeviceSpeed = 60 * kRadiansPerDegree;

double Approach(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

// One axis of a device, in the units of its control.
struct Axis {
  std::uint32_t id = 0;
  bool absolute = false;
  double unit_rad = 0;
  std::int64_t lowest = 0, highest = 0, step = 1;

  // The nearest valid value: within the range, and a whole number of steps from the lowest value (absolute)
  // or from zero (relative).
  std::int64_t Nearest(double angle_rad) const {
    const double wanted =
        std::clamp(angle_rad / unit_rad, static_cast<double>(lowest), static_cast<double>(highest));
    const std::int64_t origin = absolute ? lowest : 0;
    const auto steps = static_cast<std::int64_t>(
        std::round((wanted - static_cast<double>(origin)) / static_cast<double>(step)));
    const std::int64_t value = origin + steps * step;
    return value > highest ? value - step : value < lowest ? value + step : value;
  }
};

std::optional<Axis> FindAxis(DeviceSystem* system, int file, std::uint32_t absolute, std::uint32_t relative) {
  // V4L2 defines absolute angles in arc seconds and leaves the unit of relative ones to the device; devices
  // with relative controls use 64 units per degree.
  constexpr double kArcSecond = kRadiansPerDegree / 3600, kStep = kRadiansPerDegree / 64;
  for (const std::uint32_t id : {absolute, relative}) {
    v4l2_queryctrl query{};
    query.id = id;
    if (system->Control(file, VIDIOC_QUERYCTRL, &query) < 0 || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0)
      continue;
    if (query.maximum <= query.minimum) continue;
    return Axis{id,
                id == absolute,
                id == absolute ? kArcSecond : kStep,
                query.minimum,
                query.maximum,
                std::max(1, query.step)};
  }
  return std::nullopt;
}

// The two axes of a device; tilt may be missing.
struct Axes {
  Axis pan;
  std::optional<Axis> tilt;
};

std::optional<Axes> FindAxes(DeviceSystem* system, int file) {
  const auto pan = FindAxis(system, file, V4L2_CID_PAN_ABSOLUTE, V4L2_CID_PAN_RELATIVE);
  if (!pan) return std::nullopt;
  return Axes{*pan, FindAxis(system, file, V4L2_CID_TILT_ABSOLUTE, V4L2_CID_TILT_RELATIVE)};
}

PanTiltRange RangeOf(const Axes& axes) {
  // No head turns by more than 180 degrees to a side, whatever the driver reports. Known devices with
  // relative controls can turn as far to each side as their largest step.
  const auto ends = [](const Axis& axis) {
    return std::pair(std::max(static_cast<double>(axis.lowest) * axis.unit_rad, -std::numbers::pi),
                     std::min(static_cast<double>(axis.highest) * axis.unit_rad, std::numbers::pi));
  };
  const auto [left, right] = ends(axes.pan);
  const auto [down, up] = axes.tilt ? ends(*axes.tilt) : std::pair(0.0, 0.0);
  return {{left, down}, {right, up}, kDeviceSpeed};
}

class DeviceHead : public Head {
 public:
  DeviceHead(std::unique_ptr<DeviceSystem> system, std::string path, int file, const Axes& axes)
      : system_(std::move(system)), path_(std::move(path)), file_(file), axes_(axes), range_(RangeOf(axes)) {
    Begin();
  }
  ~DeviceHead() override {
    if (file_ >= 0) system_->Close(file_);
  }

  const PanTiltRange& range() const override { return range_; }
  PanTilt At(Timestamp time) const override {
    const std::scoped_lock lock(mutex_);
    return motion_->At(time);
  }
  void LookAt(const PanTilt& wanted, Timestamp now) override {
    const std::scoped_lock lock(mutex_);
    if (file_ < 0) Reopen();
    const PanTilt to = range_.Clamped(wanted), from = motion_->target();
    PanTilt reached = from;
    reached.pan_rad = MoveAxis(axes_.pan, from.pan_rad, to.pan_rad);
    if (axes_.tilt) reached.tilt_rad = MoveAxis(*axes_.tilt, from.tilt_rad, to.tilt_rad);
    motion_->LookAt(reached, now);
  }
  void Release() override {
    const std::scoped_lock lock(mutex_);
    if (file_ >= 0) Close();
  }

 private:
  // Initializes the motion model with the position that the device reports, or straight ahead without one.
  void Begin() {
    const auto position = [&](const Axis& axis, std::uint32_t reset) {
      if (!axis.absolute) {
        WriteControl(system_.get(), file_, reset, 1);
        return 0.0;
      }
      const auto value = ReadControl(system_.get(), file_, axis.id);
      return value ? static_cast<double>(*value) * axis.unit_rad : 0.0;
    };
    PanTilt at;
    at.pan_rad = position(axes_.pan, V4L2_CID_PAN_RESET);
    if (axes_.tilt) at.tilt_rad = position(*axes_.tilt, V4L2_CID_TILT_RESET);
    motion_.emplace(range_, range_.Clamped(at));
  }

  // A device that was unplugged is at its initial position again.
  void Reopen() {
    file_ = system_->Open(path_);
    if (file_ < 0) return;
    const auto axes = FindAxes(system_.get(), file_);
    if (axes && axes->pan.absolute == axes_.pan.absolute &&
        axes->tilt.has_value() == axes_.tilt.has_value()) {
      axes_ = *axes;
      Begin();
      return;
    }
    Close();  // Another camera has this path now.
  }
  void Close() {
    system_->Close(file_);
    file_ = -1;
  }

  // Moves an axis and returns the angle that it moves to. When the driver rejects the command (used by
  // another program, not ready, disconnected), the axis stays, and the caller will ask again.
  double MoveAxis(const Axis& axis, double from_rad, double to_rad) {
    if (file_ < 0) return from_rad;
    v4l2_control control{};
    control.id = axis.id;
    const std::int64_t value = axis.Nearest(axis.absolute ? to_rad : to_rad - from_rad);
    if (!axis.absolute && value == 0) return from_rad;
    control.value = static_cast<std::int32_t>(value);
    if (system_->Control(file_, VIDIOC_S_CTRL, &control) < 0) {
      if (errno == ENODEV || errno == ENXIO) Close();
      return from_rad;
    }
    // The driver may have set another value, which it returns.
    const double taken_rad = static_cast<double>(control.value) * axis.unit_rad;
    return axis.absolute ? taken_rad : from_rad + taken_rad;
  }

  const std::unique_ptr<DeviceSystem> system_;
  const std::string path_;
  mutable std::mutex mutex_;  // Guards the members below.
  int file_;                  // -1 while the device is disconnected.
  Axes axes_;
  const PanTiltRange range_;
  std::optional<HeadMotion> motion_;
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
  const auto axes = FindAxes(system.get(), file);
  if (!axes) {
    system->Close(file);
    return nullptr;
  }
  auto head = std::make_unique<DeviceHead>(std::move(system), path, file, *axes);
  head->LookAt({}, {});
  return head;
}

}  // namespace docent::app
