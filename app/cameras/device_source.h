// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/cameras/device_controls.h"
#include "app/cameras/device_system.h"
#include "app/cameras/frame_source.h"

// V4L2 cameras through the kernel interface (linux/videodev2.h): streaming with mapped buffers and a time-out
// for each image. The pixel format is the first of YUYV, NV12, Motion-JPEG and grey that reaches the
// requested frame rate at the requested size.
namespace docent::app {

// Opens and starts the device. Throws Error with one sentence when the device does not exist, is busy, may
// not be opened, is not a camera, or offers no supported pixel format.
//
// Next returns the newest image; older images that were not fetched in time are returned to the device unread
// and counted as late. When no image arrives in time or the device is unplugged, Next throws Error, or, with
// CameraOptions::reconnect, returns empty images while it tries to open the same path again. A device that
// returns with another image size is rejected.
std::unique_ptr<FrameSource> OpenDevice(const std::string& path, const CameraOptions& options,
                                        std::unique_ptr<DeviceSystem> system = MakeDeviceSystem());

// The properties of one device that `docent cameras` lists.
struct DeviceSize {
  int width_px = 0, height_px = 0;
  std::vector<double> fps;  // Frame rates that the device lists for this size, highest first.
};
struct DevicePixelFormat {
  std::string fourcc;       // "YUYV"
  std::string description;  // Description given by the driver.
  std::vector<DeviceSize> sizes;
};
struct DeviceDescription {
  std::string path, card, driver;
  std::string trouble;  // One sentence when the device may not be opened; the other fields are then empty.
  std::vector<DevicePixelFormat> formats;
  std::vector<DeviceControl> controls;
};

// Empty when the path is not a video capture device.
std::optional<DeviceDescription> DescribeDevice(const std::string& path, DeviceSystem* system);
// Every /dev/videoN that captures video or may not be opened, ordered by number.
std::vector<DeviceDescription> ListDevices(DeviceSystem* system);
// Frame rates that an open device lists for a format and size, highest first; often empty.
std::vector<double> DeviceRates(DeviceSystem* system, int file, std::uint32_t pixel_format, int width_px,
                                int height_px);
// Advice for a device that may not be opened; the second half of a sentence.
std::string PermissionAdvice();

}  // namespace docent::app
