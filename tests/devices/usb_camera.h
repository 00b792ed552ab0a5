// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/worker.h"

namespace docent::app {

// A USB camera with pan and tilt, emulated in software: it speaks USB/IP (the kernel's
// Documentation/usb/usbip_protocol.rst) to vhci_hcd, so that the kernel sees a real USB device and binds its
// own webcam driver, uvcvideo, to it. Its descriptors follow USB Video Class 1.0: a camera terminal with
// absolute pan and tilt, and grey 160x120 images as YUYV over a bulk endpoint. The constructor plugs it in
// and the destructor unplugs it. Root privileges are required.
class UsbCamera {
 public:
  static constexpr int kWidth_px = 160, kHeight_px = 120;
  // The range and step of both axes, in arc seconds.
  static constexpr std::int32_t kLowest = -100 * 3600, kHighest = 100 * 3600, kStep = 1800;
  static constexpr char kName[] = "Docent test camera";

  UsbCamera();
  ~UsbCamera();
  UsbCamera(const UsbCamera&) = delete;
  UsbCamera& operator=(const UsbCamera&) = delete;

  // The path of its video device. Waits up to ten seconds until the driver has created it; empty if it has
  // not.
  std::string Path() const;
  std::int32_t pan() const { return pan_; }
  std::int32_t tilt() const { return tilt_; }
  // The device rejects every motion request with this code of the class's request error control
  // (UVC 1.0, 4.2.1.2): 0 accepts requests, 1 means not ready, 4 means out of range.
  void RejectMotion(std::uint8_t error_code) { rejection_code_ = error_code; }

 private:
  struct Request {
    std::uint32_t command = 0, sequence = 0, direction = 0, endpoint = 0, length = 0;
    std::array<std::uint8_t, 8> setup{};
    std::vector<std::uint8_t> data;  // sent to the device
  };
  // The response to a request; status is 0 or a negative errno.
  struct Answer {
    std::int32_t status = 0;
    std::vector<std::uint8_t> data;
  };

  void Serve();
  bool Receive(Request* request);
  bool Send(const Request& request, const Answer& answer);
  Answer OnControl(const Request& request);
  Answer OnClassRequest(const Request& request);
  Answer OnPanTilt(std::uint8_t request_code, const Request& request);
  Answer NextPayload(std::size_t room);

  int device_end_ = -1;
  std::atomic<std::int32_t> pan_ = 0, tilt_ = 0;
  std::atomic<std::uint8_t> rejection_code_ = 0;
  std::uint8_t last_error_ = 0;
  std::size_t sent_bytes_ = 0;  // of the current image
  std::uint8_t image_ = 0;
  std::vector<std::uint8_t> probe_;
  Worker worker_;  // last member, because it uses the others
};

}  // namespace docent::app
