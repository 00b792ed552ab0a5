// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "app/cameras/device_system.h"
#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

// A camera that can turn its head: on a carrier (a shoulder, a shelf) it pans and tilts about its centre. The
// carrier's frame is that of the camera when it looks straight ahead (x right, y down, z forward). A head
// belongs to the source of its images; any thread may use it.
namespace docent::app {

struct PanTilt {
  double pan_rad = 0;   // to the right
  double tilt_rad = 0;  // upwards
};

struct PanTiltRange {
  PanTilt lowest, highest;
  double speed_rad_per_s = 1;  // of each axis

  PanTilt Clamped(const PanTilt& wanted) const;
  // How long the way between two directions takes, seconds.
  double TravelSeconds(const PanTilt& from, const PanTilt& to) const;
};

engine::Rotation3 CarrierFromCamera(const PanTilt& at);
// Where to look for a direction of the carrier's frame to be in the middle of the image.
PanTilt Toward(const Eigen::Vector3d& direction_in_carrier);

// Where a head is that was told where to go: it turns about both axes at its speed until it is there. Few
// devices say where they are, so this is also how theirs is reckoned.
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
  // Where it looks at a time on the clock of its images, as far as is known.
  virtual PanTilt At(Timestamp time) const = 0;
  // Goes there; what is out of range, as near as it can.
  virtual void LookAt(const PanTilt& wanted, Timestamp now) = 0;
};

// A V4L2 device's pan and tilt, absolute (arc seconds) or, on devices that have no other, relative. Null when
// the device has neither or cannot be opened. It looks straight ahead at first. Values are those that the
// control's range and step allow; an axis that the driver refuses to turn stays where it is until it is asked
// again, and a device that was unplugged is opened again when it is back.
std::unique_ptr<Head> OpenDeviceHead(std::unique_ptr<DeviceSystem> system, const std::string& path);

}  // namespace docent::app
