// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "app/session/guided_view.h"

namespace docent::app {

// Hands frames from the camera threads to the window's thread. There is one slot for each camera, and a newer
// frame replaces an older one, so that a slow screen never blocks a camera. Any thread.
class FrameSlot {
 public:
  explicit FrameSlot(std::size_t cameras) : frames_(cameras) {}
  void Put(std::shared_ptr<const ShownFrame> frame);
  // Says that no more frames will come.
  void Close();
  // Returns the newest frame of each camera that was not taken yet, or null. Waits up to 1/60 s for a frame.
  std::vector<std::shared_ptr<const ShownFrame>> Take();
  bool closed() const;  // Closed, and all frames were taken.

 private:
  bool HasFrame() const;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<const ShownFrame>> frames_;
  bool closed_ = false;
};

}  // namespace docent::app
