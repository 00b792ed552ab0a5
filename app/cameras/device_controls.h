// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/cameras/device_system.h"

// The controls of a V4L2 device: those that `docent cameras` lists, and the automatic ones that must be
// locked while the camera is tracked.
namespace docent::app {

struct DeviceControl {
  std::uint32_t id = 0;  // V4L2_CID_...
  std::string name;      // Name given by the driver.
  std::int64_t minimum = 0, maximum = 0, step = 0, default_value = 0, value = 0;
};

// Lists all controls that have a readable value and are not disabled.
std::vector<DeviceControl> ListControls(DeviceSystem* system, int file);
std::optional<std::int64_t> ReadControl(DeviceSystem* system, int file, std::uint32_t id);
// Returns false when the device lacks the control or rejects the value.
bool WriteControl(DeviceSystem* system, int file, std::uint32_t id, std::int64_t value);

// The controls that were changed, in the order in which they must be restored.
struct LockedControls {
  struct Change {
    std::uint32_t id;
    std::int64_t before;
  };
  std::vector<Change> changes;
};

// Switches automatic exposure, gain, white balance and focus to manual with their present values. Controls
// that the device lacks are skipped.
LockedControls LockControls(DeviceSystem* system, int file);
// Restores the controls changed by LockControls, so that the next program finds the device as before.
void UnlockControls(DeviceSystem* system, int file, const LockedControls& locked);

}  // namespace docent::app
