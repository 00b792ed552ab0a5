// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

namespace docent::app {

// The few calls of the operating system that a V4L2 camera needs, so that tests can stand a camera in for the
// kernel. Every function answers as its namesake does: a negative number or null with errno set.
class DeviceSystem {
 public:
  virtual ~DeviceSystem() = default;
  virtual int Open(const std::string& path) = 0;
  virtual void Close(int file) = 0;
  // Begins anew when a signal interrupts it.
  virtual int Control(int file, unsigned long request, void* argument) = 0;
  virtual void* Map(int file, std::size_t length_bytes, long offset_bytes) = 0;  // null when it fails
  virtual void Unmap(void* memory, std::size_t length_bytes) = 0;
  // 1 when an image waits, 0 after the time-out, -1 with errno; ENODEV when the device is gone.
  virtual int Wait(int file, int timeout_ms) = 0;
  // The clock that the kernel stamps images with, CLOCK_MONOTONIC.
  virtual std::chrono::nanoseconds Now() = 0;
  virtual void Sleep(std::chrono::milliseconds duration) = 0;
};

// The kernel's own.
std::unique_ptr<DeviceSystem> MakeDeviceSystem();

}  // namespace docent::app
