// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "app/cameras/device_system.h"
#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

// Pan-tilt heads: on a carrier (a shoulder, a shelf) the camera pans and tilts about its centre. The carrier
// frame is the camera frame at zero pan and tilt (x right, y down, z forward). A head belongs to the source
// of its images; any thread may use it.
namespace docent::app {

struct PanTilt {
  double pan_rad = 0;   // Positive to the right.
  double tilt_rad = 0;  // Positive upwards.
};

struct PanTiltRange {
  PanTilt lowest, highest;
  double speed_rad_per_s = 1;  // Speed of each axis.

  PanTilt Clamped(const PanTilt& wanted) const;
  // Time to move between two directions, in seconds.
  double TravelSeconds(const PanTilt& from, const PanTilt& to) const;
};

engine::Rotation3 CarrierFromCamera(const PanTilt& at);
// Pan and tilt that bring a direction of the carrier frame to the centre of the image.
PanTilt Toward(const Eigen::Vector3d& direction_in_carrier);

// Motion model of a head: it moves about both axes at constant speed until it reaches its target. Few devices
// report their position, so this model also predicts theirs.
class HeadMotion {
 public:
  explicit HeadMotion(const PanTiltRange& range, const PanTilt& at = {})
      : range_(range), start_(at), target_(at) {}
  void LookAt(const PanTilt& wanted, Timestamp now);
  PanTilt At(Timestamp time) const;
  const PanTilt& target() const { return target_; }

 private:
  const PanTiltRange range_;
  Timestamp begin_{};
  PanTilt start_, target_;
};

class Head {
 public:
  virtual ~Head() = default;
  virtual const PanTiltRange& range() const = 0;
  // Estimated direction at a time on the clock of the images.
  virtual PanTilt At(Timestamp time) const = 0;
  // Moves to the direction, clamped to the range.
  virtual void LookAt(const PanTilt& wanted, Timestamp now) = 0;
  // Closes the device until the next LookAt. The source calls it when its device is gone, because the kernel
  // gives a device that comes back the same name only after all its users have closed it.
  virtual void Release() {}
};

// Opens the pan-tilt controls of a V4L2 device: absolute ones (arc seconds) or, on devices without these,
// relative ones. Null when the device has neither or cannot be opened. The head first moves straight ahead.
// Values are rounded to the control's range and step. An axis whose command the driver rejects stays at its
// position until the next command, and a device that was unplugged is opened again by the next command.
std::unique_ptr<Head> OpenDeviceHead(std::unique_ptr<DeviceSystem> system, const std::string& path);

}  // namespace docent::app
