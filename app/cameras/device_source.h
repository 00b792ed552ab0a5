// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

#include "app/cameras/device_system.h"
#include "app/cameras/frame_source.h"

// V4L2 cameras by the kernel's own interface (linux/videodev2.h): streaming with mapped buffers, a time-out
// on every picture, and pictures in YUYV, Motion-JPEG or grey, whichever of them the device offers at the
// size that is asked.
namespace docent::app {

// Opens and starts the device. Throws Error with one sentence: no such device, busy, not permitted, no
// camera, no known pixel format. Next throws Error when no picture comes in time or the device is unplugged.
std::unique_ptr<FrameSource> OpenDevice(const std::string& path, const CameraOptions& options,
                                        std::unique_ptr<DeviceSystem> system = MakeDeviceSystem());

// What `docent cameras` shows of one device.
struct DeviceSize {
  int width_px = 0, height_px = 0;
  std::vector<double> fps;  // the rates that the device names for this size, highest first
};
struct DevicePixelFormat {
  std::string fourcc;       // "YUYV"
  std::string description;  // the driver's words
  std::vector<DeviceSize> sizes;
};
struct DeviceControl {
  std::string name;
  std::int64_t minimum = 0, maximum = 0, step = 0, default_value = 0, value = 0;
};
struct DeviceDescription {
  std::string path, card, driver;
  std::vector<DevicePixelFormat> formats;
  std::vector<DeviceControl> controls;
};

// Empty when the path is no video capture device or cannot be opened.
std::optional<DeviceDescription> DescribeDevice(const std::string& path, DeviceSystem* system);
// Every /dev/videoN that captures video, by number.
std::vector<DeviceDescription> ListDevices(DeviceSystem* system);

// One picture as the device delivered it, to BGR or grey in a buffer of its own. `stride_bytes` is the
// distance between rows. Throws Error when there are too few bytes or the pixel format is none of the three.
cv::Mat ConvertDevicePicture(std::uint32_t pixel_format, std::span<const std::uint8_t> bytes, cv::Size size,
                             std::size_t stride_bytes, const std::string& name);

}  // namespace docent::app
