// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb_camera.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace docent::app {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr char kController[] = "/sys/devices/platform/vhci_hcd.0/";
constexpr int kPort = 0;
constexpr std::uint32_t kDevice = 0x00010002, kSubmit = 1, kUnlink = 2, kReturnSubmit = 3, kReturnUnlink = 4;
constexpr std::size_t kPayloadBytes = 16384, kPayloadHeaderBytes = 2;
constexpr std::size_t kImageBytes = UsbCamera::kWidth_px * UsbCamera::kHeight_px * 2;
constexpr std::uint32_t kInterval = 400000;  // in units of 100 ns: 25 images per second

// Appends a little-endian value, the byte order of USB.
void Put(Bytes* bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes->push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
std::uint32_t BigEndian(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}
void PutBigEndian(Bytes* bytes, std::uint32_t value) {
  for (int i = 3; i >= 0; --i) bytes->push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
std::int32_t Signed(const std::uint8_t* bytes) {
  return static_cast<std::int32_t>(std::uint32_t{bytes[3]} << 24 | std::uint32_t{bytes[2]} << 16 |
                                   std::uint32_t{bytes[1]} << 8 | bytes[0]);
}
void Append(Bytes* bytes, const Bytes& more) {
  for (const std::uint8_t byte : more) bytes->push_back(byte);
}

Bytes DeviceDescriptor() {
  return {18, 1, 0x00, 0x02, 0xEF, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x01, 0x00, 0, 1, 0, 1};
}

Bytes ConfigurationDescriptor() {
  Bytes control = {13,   0x24, 1, 0x00, 0x01, 13 + 18 + 9, 0, 0x00, 0x6C, 0xDC, 0x02, 1,
                   1,  // header: one streaming interface
                   18,   0x24, 2, 1,    0x01, 0x02,        0, 0,    0,    0,    0,    0, 0, 0, 3, 0x00, 0x08,
                   0x00,                                                 // camera with absolute pan and tilt
                   9,    0x24, 3, 2,    0x01, 0x01,        0, 1,    0};  // output to USB
  Bytes streaming = {14,   0x24, 1,    1,    14 + 27 + 30, 0,   0x81, 0,   2, 0, 0,    0,  1,    0, 27,
                     0x24, 4,    1,    1,    'Y',          'U', 'Y',  '2', 0, 0, 0x10, 0,  0x80, 0, 0,
                     0xAA, 0,    0x38, 0x9B, 0x71,         16,  1,    0,   0, 0, 0,    30, 0x24, 5, 1,
                     0};
  Put(&streaming, UsbCamera::kWidth_px, 2);
  Put(&streaming, UsbCamera::kHeight_px, 2);
  Put(&streaming, kImageBytes * 8 * 25, 4);
  Put(&streaming, kImageBytes * 8 * 25, 4);
  Put(&streaming, kImageBytes, 4);
  Put(&streaming, kInterval, 4);
  Put(&streaming, 1, 1);
  Put(&streaming, kInterval, 4);
  Bytes all = {9, 2,  0, 0, 2,    1,    0, 0x80, 50,  // two interfaces, bus-powered
               8, 11, 0, 2, 0x0E, 3,    0, 0,         // interface association: one video function
               9, 4,  0, 0, 0,    0x0E, 1, 0,    0};
  Append(&all, control);
  Append(&all, {9, 4, 1, 0, 1, 0x0E, 2, 0, 0});
  Append(&all, streaming);
  Append(&all, {7, 5, 0x81, 2, 0x00, 0x02, 0});  // bulk, 512 bytes per packet
  all[2] = static_cast<std::uint8_t>(all.size());
  all[3] = static_cast<std::uint8_t>(all.size() >> 8);
  return all;
}

Bytes StringDescriptor(std::uint8_t index) {
  if (index == 0) return {4, 3, 0x09, 0x04};
  Bytes bytes = {0, 3};
  for (const char* letter = UsbCamera::kName; *letter != '\0'; ++letter)
    Put(&bytes, static_cast<std::uint8_t>(*letter), 2);
  bytes[0] = static_cast<std::uint8_t>(bytes.size());
  return bytes;
}

// The streaming parameters: the only format, size and rate.
Bytes Probe() {
  Bytes bytes;
  Put(&bytes, 1, 2);
  Put(&bytes, 1, 1);
  Put(&bytes, 1, 1);
  Put(&bytes, kInterval, 4);
  for (int i = 0; i < 5; ++i) Put(&bytes, 0, 2);
  Put(&bytes, kImageBytes, 4);
  Put(&bytes, kPayloadBytes, 4);
  return bytes;
}

void WriteToController(const char* file, const std::string& text) {
  std::ofstream out(std::string(kController) + file);
  out << text << std::flush;
  if (!out) throw std::runtime_error("vhci_hcd rejects '" + text + "' in " + file);
}

bool ReadAll(int file, std::uint8_t* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t got = recv(file, bytes, size, 0);
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

// The video device that the driver has created for this camera; empty while there is none.
std::string VideoDevice() {
  const auto first_line = [](const std::filesystem::path& path) {
    std::string line;
    std::ifstream file(path);
    std::getline(file, line);
    return line;
  };
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/video4linux", error)) {
    // The camera's second device, for metadata, has the index 1.
    if (first_line(entry.path() / "name").starts_with(UsbCamera::kName) &&
        first_line(entry.path() / "index") == "0")
      return "/dev/" + entry.path().filename().string();
  }
  return {};
}

// Waits for a condition for ten seconds at most.
template <typename Condition>
void WaitFor(const Condition& condition) {
  for (int i = 0; i < 200 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

int PlugIn() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) throw std::runtime_error("no socket");
  constexpr int kHighSpeed = 3;
  WriteToController("attach", std::to_string(kPort) + " " + std::to_string(ends[0]) + " " +
                                  std::to_string(kDevice) + " " + std::to_string(kHighSpeed));
  close(ends[0]);  // the kernel has its own reference
  return ends[1];
}

}  // namespace

UsbCamera::UsbCamera()
    : device_end_(PlugIn()),
      probe_(Probe()),
      worker_("usb camera", [this](const std::stop_token&) { Serve(); }) {}

UsbCamera::~UsbCamera() {
  shutdown(device_end_, SHUT_RDWR);
  worker_.Join();
  close(device_end_);
  // The port becomes free after the kernel has removed all devices on it.
  const auto port_is_free = [] {
    std::ifstream status(std::string(kController) + "status");
    std::string header, hub, port, state;
    std::getline(status, header);
    status >> hub >> port >> state;
    return state == "004";
  };
  WaitFor([&] { return port_is_free() && VideoDevice().empty(); });
}

std::string UsbCamera::Path() const {
  std::string path;
  WaitFor([&] {
    path = VideoDevice();
    return !path.empty() && std::filesystem::exists(path);
  });
  return path;
}

bool UsbCamera::Receive(Request* request) {
  std::uint8_t header[48];
  if (!ReadAll(device_end_, header, sizeof header)) return false;
  request->command = BigEndian(header);
  request->sequence = BigEndian(header + 4);
  request->direction = BigEndian(header + 12);
  request->endpoint = BigEndian(header + 16);
  if (request->command != kSubmit) return true;
  request->length = BigEndian(header + 24);
  std::copy(header + 40, header + 48, request->setup.begin());
  if (request->direction == 0) request->data.resize(request->length);
  return ReadAll(device_end_, request->data.data(), request->data.size());
}

bool UsbCamera::Send(const Request& request, const Answer& answer) {
  Bytes bytes;
  const bool submitted = request.command == kSubmit, inwards = request.direction == 1;
  PutBigEndian(&bytes, submitted ? kReturnSubmit : kReturnUnlink);
  PutBigEndian(&bytes, request.sequence);
  for (int i = 0; i < 3; ++i) PutBigEndian(&bytes, 0);
  PutBigEndian(&bytes, static_cast<std::uint32_t>(answer.status));
  if (submitted)
    PutBigEndian(&bytes, static_cast<std::uint32_t>(inwards ? answer.data.size() : request.data.size()));
  bytes.resize(48);
  if (submitted && inwards) Append(&bytes, answer.data);
  return send(device_end_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

void UsbCamera::Serve() {
  for (;;) {
    Request request;
    if (!Receive(&request)) return;
    Answer answer;  // an unlink always comes too late, because every request is answered immediately
    if (request.command == kSubmit) {
      answer = request.endpoint == 0 ? OnControl(request) : NextPayload(request.length);
      if (answer.data.size() > request.length) answer.data.resize(request.length);
    } else if (request.command != kUnlink) {
      return;
    }
    if (!Send(request, answer)) return;
  }
}

UsbCamera::Answer UsbCamera::OnControl(const Request& request) {
  const std::uint8_t type = request.setup[0], request_code = request.setup[1];
  if ((type & 0x60) == 0x20) return OnClassRequest(request);
  constexpr std::uint8_t kGetStatus = 0, kGetDescriptor = 6, kGetConfiguration = 8;
  if (request_code == kGetStatus) return {0, {0, 0}};
  if (request_code == kGetConfiguration) return {0, {1}};
  if (request_code != kGetDescriptor) return {};
  switch (request.setup[3]) {
    case 1:
      return {0, DeviceDescriptor()};
    case 2:
      return {0, ConfigurationDescriptor()};
    case 3:
      return {0, StringDescriptor(request.setup[2])};
    default:
      return {-EPIPE, {}};
  }
}

UsbCamera::Answer UsbCamera::OnClassRequest(const Request& request) {
  const std::uint8_t request_code = request.setup[1], selector = request.setup[3];
  const std::uint8_t interface = request.setup[4], entity = request.setup[5];
  constexpr std::uint8_t kSetCurrent = 0x01, kGetLength = 0x85, kGetInfo = 0x86;
  if (interface == 0 && entity == 1 && selector == 0x0D) return OnPanTilt(request_code, request);
  if (interface == 0 && entity == 0 && selector == 0x02) return {0, {last_error_}};
  if (interface != 1 || entity != 0 || (selector != 1 && selector != 2)) return {-EPIPE, {}};
  if (request_code == kSetCurrent) {
    sent_bytes_ = 0;
    return {};
  }
  if (request_code == kGetLength) return {0, {static_cast<std::uint8_t>(probe_.size()), 0}};
  if (request_code == kGetInfo) return {0, {3}};
  return {0, probe_};
}

UsbCamera::Answer UsbCamera::OnPanTilt(std::uint8_t request_code, const Request& request) {
  const auto both = [](std::int32_t pan, std::int32_t tilt) {
    Bytes bytes;
    Put(&bytes, static_cast<std::uint32_t>(pan), 4);
    Put(&bytes, static_cast<std::uint32_t>(tilt), 4);
    return Answer{0, bytes};
  };
  switch (request_code) {
    case 0x01:  // set
      last_error_ = rejection_code_;
      if (last_error_ != 0 || request.data.size() < 8) return {-EPIPE, {}};
      pan_ = Signed(request.data.data());
      tilt_ = Signed(request.data.data() + 4);
      return {};
    case 0x81:
      return both(pan_, tilt_);
    case 0x82:
      return both(kLowest, kLowest);
    case 0x83:
      return both(kHighest, kHighest);
    case 0x84:
      return both(kStep, kStep);
    case 0x85:
      return {0, {8, 0}};
    case 0x86:
      return {0, {3}};
    case 0x87:
      return both(0, 0);
    default:
      return {-EPIPE, {}};
  }
}

// An image is sent in payloads. The header bits of a payload say to which image it belongs and whether it is
// the last one. Every image is uniformly grey, one level brighter than the image before.
UsbCamera::Answer UsbCamera::NextPayload(std::size_t room) {
  if (sent_bytes_ == 0) std::this_thread::sleep_for(std::chrono::milliseconds(40));
  const std::size_t left = kImageBytes - sent_bytes_;
  const std::size_t bytes = std::min(left, std::min(room, kPayloadBytes) - kPayloadHeaderBytes);
  const bool last = bytes == left;
  Answer answer;
  answer.data = {kPayloadHeaderBytes, static_cast<std::uint8_t>(0x80 | (last ? 0x02 : 0) | (image_ & 1))};
  for (std::size_t i = 0; i < bytes; ++i)
    answer.data.push_back((sent_bytes_ + i) % 2 == 0 ? static_cast<std::uint8_t>(16 + image_ % 200) : 128);
  sent_bytes_ = last ? 0 : sent_bytes_ + bytes;
  if (last) ++image_;
  return answer;
}

}  // namespace docent::app
