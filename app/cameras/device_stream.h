// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <chrono>
#include <cstdint>
#include <opencv2/core/types.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/cameras/device_system.h"
#include "app/cameras/frame_source.h"
#include "engine/base/error.h"

namespace docent::app {

// The device no longer responds, because it was unplugged or its driver released it.
class DeviceGone : public Error {
 public:
  using Error::Error;
};

// An open V4L2 device with negotiated format and frame rate and mapped buffers that is streaming. An instance
// does not survive unplugging. All resources are released by the destructor, also when the constructor
// throws. One thread; the system must outlive it. All functions throw DeviceGone when the device is gone, and
// Error for every other failure.
class DeviceStream {
 public:
  // Throws Error with one sentence when the device does not exist, is busy, may not be opened, is not a
  // camera, or offers no supported pixel format.
  DeviceStream(const std::string& path, const DeviceFormat& wanted, DeviceSystem* system);
  ~DeviceStream() { Stop(); }
  DeviceStream(const DeviceStream&) = delete;
  DeviceStream& operator=(const DeviceStream&) = delete;

  // A filled buffer that belongs to the caller until Return. The bytes are in memory shared with the driver.
  struct Loan {
    v4l2_buffer buffer{};
    std::span<const std::uint8_t> bytes;
    bool broken() const { return (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0; }
    std::uint32_t sequence() const { return buffer.sequence; }
  };

  // Waits for an image. Returns false after the time-out.
  bool Wait(std::chrono::milliseconds timeout);
  // Takes the next image. Empty when none is available.
  std::optional<Loan> Take();
  void Return(Loan* loan);
  // Capture time of the image on CLOCK_MONOTONIC: the kernel's timestamp, or the current time for the few
  // drivers that use another clock.
  Timestamp TimeOf(const Loan& loan) const;

  int file() const { return file_; }
  std::size_t buffer_count() const { return buffers_.size(); }
  std::uint32_t pixel_format() const { return pixel_format_; }
  cv::Size size() const { return size_; }
  std::size_t stride_bytes() const { return stride_bytes_; }
  double fps() const { return fps_; }  // Frame rate reported by the device; 30 when it reports none.

 private:
  struct MappedBuffer {
    void* memory = nullptr;
    std::size_t length_bytes = 0;
  };
  void Open();
  void NegotiateFormat(const DeviceFormat& wanted);
  std::optional<v4l2_pix_format> RequestFormat(unsigned long request, std::uint32_t pixel_format,
                                               const DeviceFormat& wanted);
  void NegotiateRate(double fps);
  void StartStreaming();
  void Stop() noexcept;
  static constexpr const char* kReplug = "unplug the camera and plug it in again";
  [[noreturn]] void Fail(const std::string& what, int error, const std::string& advice = kReplug) const;

  const std::string path_;
  DeviceSystem* const system_;
  int file_ = -1;
  bool streaming_ = false;
  std::uint32_t pixel_format_ = 0;
  cv::Size size_;
  std::size_t stride_bytes_ = 0;
  double fps_ = 30;
  std::vector<MappedBuffer> buffers_;
};

}  // namespace docent::app
