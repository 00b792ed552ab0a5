// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/cameras/device_controls.h"
#include "app/cameras/device_system.h"
#include "app/cameras/frame_source.h"

// V4L2 cameras by the kernel's own interface (linux/videodev2.h): streaming with mapped buffers, a time-out
// on every image, and images in YUYV, NV12, Motion-JPEG or grey, the first of them that the device
// delivers fast enough at the size that is asked.
namespace docent::app {

// Opens and starts the device. Throws Error with one sentence: no such device, busy, not permitted, no
// camera, no known pixel format.
//
// Next gives the newest image there is: older ones that nobody fetched in time go back to the device unread
// and are counted as late. When no image comes in time or the device is unplugged, it throws Error, or,
// with CameraOptions::reconnect, answers with empty images while it tries to open the same path again; a
// device that comes back with another image size is refused until it goes away again.
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
struct DeviceDescription {
  std::string path, card, driver;
  std::string trouble;  // a sentence when the device is there but may not be opened; then the rest is empty
  std::vector<DevicePixelFormat> formats;
  std::vector<DeviceControl> controls;
};

// Empty when the path is no video capture device.
std::optional<DeviceDescription> DescribeDevice(const std::string& path, DeviceSystem* system);
// Every /dev/videoN that captures video or may not be opened, by number.
std::vector<DeviceDescription> ListDevices(DeviceSystem* system);
// The rates that an open device names for a format and size, highest first; often none.
std::vector<double> DeviceRates(DeviceSystem* system, int file, std::uint32_t pixel_format, int width_px,
                                int height_px);
// What to do when a device may not be opened; the second half of a sentence.
std::string PermissionAdvice();

}  // namespace docent::app
