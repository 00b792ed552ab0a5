// SPDX-License-Identifier: Apache-2.0
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <functional>

#include "app/cameras/device_source.h"
#include "app/files/text_file.h"

namespace docent::app {

namespace {

// Limits the enumeration, in case a driver never reports the end of its list.
constexpr std::uint32_t kMaxEntries = 256;

std::string FromDriver(const std::uint8_t* text, std::size_t size) {
  const auto* begin = reinterpret_cast<const char*>(text);
  return std::string(begin, std::find(begin, begin + size, '\0'));
}

std::string FourCc(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const char c = static_cast<char>(code >> shift);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

std::vector<DeviceSize> Sizes(DeviceSystem* system, int file, std::uint32_t pixel_format) {
  std::vector<DeviceSize> sizes;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = pixel_format;
    if (system->Control(file, VIDIOC_ENUM_FRAMESIZES, &entry) < 0) break;
    const bool discrete = entry.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    DeviceSize size;
    size.width_px = static_cast<int>(discrete ? entry.discrete.width : entry.stepwise.max_width);
    size.height_px = static_cast<int>(discrete ? entry.discrete.height : entry.stepwise.max_height);
    size.fps = DeviceRates(system, file, pixel_format, size.width_px, size.height_px);
    sizes.push_back(std::move(size));
    if (!discrete) break;
  }
  return sizes;
}

}  // namespace

std::vector<double> DeviceRates(DeviceSystem* system, int file, std::uint32_t pixel_format, int width_px,
                                int height_px) {
  std::vector<double> rates;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = pixel_format;
    entry.width = static_cast<std::uint32_t>(width_px);
    entry.height = static_cast<std::uint32_t>(height_px);
    if (system->Control(file, VIDIOC_ENUM_FRAMEINTERVALS, &entry) < 0) break;
    const bool discrete = entry.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract& interval = discrete ? entry.discrete : entry.stepwise.min;
    if (interval.numerator > 0)
      rates.push_back(static_cast<double>(interval.denominator) / interval.numerator);
    if (!discrete) break;  // One entry describes a whole range; its shortest interval is the highest rate.
  }
  std::sort(rates.begin(), rates.end(), std::greater<>());
  return rates;
}

std::string PermissionAdvice() {
  return "ask for membership in the group 'video' (sudo usermod -aG video USER), then log in again.";
}

std::optional<DeviceDescription> DescribeDevice(const std::string& path, DeviceSystem* system) {
  std::optional<DeviceDescription> device;
  const int file = system->Open(path);
  if (file < 0) {
    if (errno != EACCES) return std::nullopt;
    device.emplace();
    device->path = path;
    device->trouble = "You do not have permission to open it; " + PermissionAdvice();
    return device;
  }
  v4l2_capability capability{};
  if (system->Control(file, VIDIOC_QUERYCAP, &capability) >= 0) {
    const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                    : capability.capabilities;
    if ((can & V4L2_CAP_VIDEO_CAPTURE) != 0) {
      device.emplace();
      device->path = path;
      device->card = FromDriver(capability.card, sizeof capability.card);
      device->driver = FromDriver(capability.driver, sizeof capability.driver);
      for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
        v4l2_fmtdesc entry{};
        entry.index = i;
        entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        if (system->Control(file, VIDIOC_ENUM_FMT, &entry) < 0) break;
        device->formats.push_back({FourCc(entry.pixelformat),
                                   FromDriver(entry.description, sizeof entry.description),
                                   Sizes(system, file, entry.pixelformat)});
      }
      device->controls = ListControls(system, file);
    }
  }
  system->Close(file);
  return device;
}

std::vector<DeviceDescription> ListDevices(DeviceSystem* system) {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    if (entry.path().filename().string().starts_with("video")) paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end(),
            [](const std::string& a, const std::string& b) { return NaturalLess(a, b); });
  std::vector<DeviceDescription> devices;
  for (const std::string& path : paths) {
    if (auto device = DescribeDevice(path, system)) devices.push_back(std::move(*device));
  }
  return devices;
}

}  // namespace docent::app
