// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <span>

namespace docent::app {

namespace {

// Limits the enumeration, in case a driver never reports the end of its list.
constexpr std::uint32_t kMaxControls = 256;

// An automatic control: its identifier, its value for manual mode, and the controls that it sets
// automatically.
struct AutomaticControl {
  std::uint32_t id;
  std::int64_t manual;
  std::array<std::uint32_t, 2> governed;  // 0: none.
};
constexpr std::array<AutomaticControl, 5> kAutomaticControls = {{
    // The first one allows the device to lower the frame rate for a longer exposure.
    {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, {0, 0}},
    {V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE}},
    {V4L2_CID_AUTOGAIN, 0, {V4L2_CID_GAIN, 0}},
    {V4L2_CID_AUTO_WHITE_BALANCE, 0, {V4L2_CID_WHITE_BALANCE_TEMPERATURE, 0}},
    {V4L2_CID_FOCUS_AUTO, 0, {V4L2_CID_FOCUS_ABSOLUTE, 0}},
}};

std::string FromDriver(std::span<const std::uint8_t> text) {
  return std::string(text.begin(), std::find(text.begin(), text.end(), '\0'));
}

}  // namespace

std::vector<DeviceControl> ListControls(DeviceSystem* system, int file) {
  std::vector<DeviceControl> controls;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  for (std::uint32_t i = 0; i < kMaxControls && system->Control(file, VIDIOC_QUERYCTRL, &query) >= 0; ++i) {
    const bool shown =
        (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 && query.type != V4L2_CTRL_TYPE_CTRL_CLASS;
    const auto value = shown ? ReadControl(system, file, query.id) : std::nullopt;
    if (value) {
      controls.push_back({query.id, FromDriver(query.name), query.minimum, query.maximum, query.step,
                          query.default_value, *value});
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

std::optional<std::int64_t> ReadControl(DeviceSystem* system, int file, std::uint32_t id) {
  v4l2_control control{};
  control.id = id;
  if (system->Control(file, VIDIOC_G_CTRL, &control) < 0) return std::nullopt;
  return control.value;
}

bool WriteControl(DeviceSystem* system, int file, std::uint32_t id, std::int64_t value) {
  v4l2_control control{};
  control.id = id;
  control.value = static_cast<std::int32_t>(value);
  return system->Control(file, VIDIOC_S_CTRL, &control) >= 0;
}

LockedControls LockControls(DeviceSystem* system, int file) {
  LockedControls locked;
  for (const AutomaticControl& automatic : kAutomaticControls) {
    const auto before = ReadControl(system, file, automatic.id);
    if (!before || *before == automatic.manual) continue;
    std::array<std::optional<std::int64_t>, 2> found;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (automatic.governed[i] != 0) found[i] = ReadControl(system, file, automatic.governed[i]);
    }
    if (!WriteControl(system, file, automatic.id, automatic.manual)) continue;
    locked.changes.push_back({automatic.id, *before});
    // Some devices return to the last manual values, so the values found automatically are written again.
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i]) WriteControl(system, file, automatic.governed[i], *found[i]);
    }
  }
  std::reverse(locked.changes.begin(), locked.changes.end());
  return locked;
}

void UnlockControls(DeviceSystem* system, int file, const LockedControls& locked) {
  for (const LockedControls::Change& change : locked.changes)
    WriteControl(system, file, change.id, change.before);
}

}  // namespace docent::app
