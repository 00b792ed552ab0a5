// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/worker.h"

namespace docent::app {

// A USB camera that turns its head, made of software: it speaks USB/IP (the kernel's
// Documentation/usb/usbip_protocol.rst) to vhci_hcd, so that the kernel sees a real USB device and binds its
// own driver for webcams, uvcvideo, to it. Its descriptors are those of USB Video Class 1.0: a camera
// terminal with absolute pan and tilt, and grey 160x120 images as YUYV over a bulk endpoint. Plugged in by
// construction and pulled out by destruction; needs the rights of root.
class UsbCamera {
 public:
  static constexpr int kWidth_px = 160, kHeight_px = 120;
  // Of both axes, seconds of arc.
  static constexpr std::int32_t kLowest = -100 * 3600, kHighest = 100 * 3600, kStep = 1800;
  static constexpr char kName[] = "Docent test camera";

  UsbCamera();
  ~UsbCamera();
  UsbCamera(const UsbCamera&) = delete;
  UsbCamera& operator=(const UsbCamera&) = delete;

  // Its video device; waits until the driver has made one. Empty after ten seconds.
  std::string Path() const;
  std::int32_t pan() const { return pan_; }
  std::int32_t tilt() const { return tilt_; }
  // The device answers every wish to turn with this code of the class's request error control; 0: it turns.
  // 1: not ready, 4: out of range (UVC 1.0, 4.2.1.2).
  void RefuseToTurn(std::uint8_t error_code) { refusal_ = error_code; }

 private:
  struct Request {
    std::uint32_t command = 0, sequence = 0, direction = 0, endpoint = 0, length = 0;
    std::array<std::uint8_t, 8> setup{};
    std::vector<std::uint8_t> data;  // that goes to the device
  };
  // What a request brings; status 0 or a negative errno.
  struct Answer {
    std::int32_t status = 0;
    std::vector<std::uint8_t> data;
  };

  void Serve();
  bool Receive(Request* request);
  bool Send(const Request& request, const Answer& answer);
  Answer OnControl(const Request& request);
  Answer OnClassRequest(const Request& request);
  Answer OnPanTilt(std::uint8_t what, const Request& request);
  Answer NextPayload(std::size_t room);

  int device_end_ = -1;
  std::atomic<std::int32_t> pan_ = 0, tilt_ = 0;
  std::atomic<std::uint8_t> refusal_ = 0;
  std::uint8_t last_error_ = 0;
  std::size_t sent_bytes_ = 0;  // of the image that is under way
  std::uint8_t image_ = 0;
  std::vector<std::uint8_t> probe_;
  Worker worker_;  // last: it uses the rest
};

}  // namespace docent::app
