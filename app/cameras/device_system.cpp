// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_system.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <thread>

namespace docent::app {

namespace {

class KernelDeviceSystem : public DeviceSystem {
 public:
  int Open(const std::string& path) override { return open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); }
  void Close(int file) override { close(file); }

  int Control(int file, unsigned long request, void* argument) override {
    int result = 0;
    do {
      result = ioctl(file, request, argument);
    } while (result < 0 && errno == EINTR);
    return result;
  }

  void* Map(int file, std::size_t length_bytes, long offset_bytes) override {
    void* memory = mmap(nullptr, length_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, offset_bytes);
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void Unmap(void* memory, std::size_t length_bytes) override { munmap(memory, length_bytes); }

  int Wait(int file, int timeout_ms) override {
    pollfd request{file, POLLIN, 0};
    int result = 0;
    do {
      result = poll(&request, 1, timeout_ms);
    } while (result < 0 && errno == EINTR);
    if (result > 0 && (request.revents & POLLIN) == 0) {
      errno = ENODEV;  // Only POLLERR or POLLHUP: the driver has released the device.
      return -1;
    }
    return result;
  }

  std::chrono::nanoseconds Now() override {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
  }
  void Sleep(std::chrono::milliseconds duration) override { std::this_thread::sleep_for(duration); }
};

}  // namespace

std::unique_ptr<DeviceSystem> MakeDeviceSystem() {
  return std::make_unique<KernelDeviceSystem>();
}

}  // namespace docent::app
