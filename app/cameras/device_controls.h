// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/cameras/device_system.h"

// The adjustments of a V4L2 device: what `docent cameras` lists, and what must stand still while a tracker
// looks through it.
namespace docent::app {

struct DeviceControl {
  std::uint32_t id = 0;  // V4L2_CID_...
  std::string name;      // the driver's words
  std::int64_t minimum = 0, maximum = 0, step = 0, default_value = 0, value = 0;
};

// Every control with a number for a value that the device does not call disabled.
std::vector<DeviceControl> ListControls(DeviceSystem* system, int file);
std::optional<std::int64_t> ReadControl(DeviceSystem* system, int file, std::uint32_t id);
// False when the device does not have it or does not take this value.
bool WriteControl(DeviceSystem* system, int file, std::uint32_t id, std::int64_t value);

// What was changed, in the order in which it is to be put back.
struct LockedControls {
  struct Change {
    std::uint32_t id;
    std::int64_t before;
  };
  std::vector<Change> changes;
  std::vector<std::string> names;  // "exposure", "white balance" …, for people

  // "exposure, gain" or empty.
  std::string Words() const;
};

// Switches automatic exposure, gain, white balance and focus off, keeping the values that they have found.
// Whatever a device does not have is passed over.
LockedControls LockControls(DeviceSystem* system, int file);
// Puts back what LockControls changed, so that the next program finds the device as it was.
void UnlockControls(DeviceSystem* system, int file, const LockedControls& locked);

}  // namespace docent::app
