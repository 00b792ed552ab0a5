// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/frame_slot.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace docent::app {

void FrameSlot::Put(std::shared_ptr<const ShownFrame> frame) {
  {
    const std::scoped_lock lock(mutex_);
    frames_.at(static_cast<std::size_t>(frame->tracked.frame.camera)) = std::move(frame);
  }
  changed_.notify_one();
}

void FrameSlot::Close() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
  }
  changed_.notify_one();
}

bool FrameSlot::HasFrame() const {
  return std::any_of(frames_.begin(), frames_.end(), [](const auto& frame) { return frame != nullptr; });
}

std::vector<std::shared_ptr<const ShownFrame>> FrameSlot::Take() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::microseconds(16667), [this] { return HasFrame() || closed_; });
  return std::exchange(frames_, std::vector<std::shared_ptr<const ShownFrame>>(frames_.size()));
}

bool FrameSlot::closed() const {
  const std::scoped_lock lock(mutex_);
  return closed_ && !HasFrame();
}

}  // namespace docent::app
