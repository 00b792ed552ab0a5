// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

namespace docent::app {

// The system calls that a V4L2 camera needs, as an interface so that tests can simulate a device. Each
// function reports failure like its system call: a negative number or null, with errno set.
class DeviceSystem {
 public:
  virtual ~DeviceSystem() = default;
  virtual int Open(const std::string& path) = 0;
  virtual void Close(int file) = 0;
  // ioctl, restarted when a signal interrupts it.
  virtual int Control(int file, unsigned long request, void* argument) = 0;
  virtual void* Map(int file, std::size_t length_bytes, long offset_bytes) = 0;  // Null on failure.
  virtual void Unmap(void* memory, std::size_t length_bytes) = 0;
  // Returns 1 when an image is available, 0 after the time-out, -1 with errno on failure; ENODEV when the
  // device is gone.
  virtual int Wait(int file, int timeout_ms) = 0;
  // CLOCK_MONOTONIC, the clock of the kernel's image timestamps.
  virtual std::chrono::nanoseconds Now() = 0;
  virtual void Sleep(std::chrono::milliseconds duration) = 0;
};

// Uses the real system calls.
std::unique_ptr<DeviceSystem> MakeDeviceSystem();

}  // namespace docent::app
