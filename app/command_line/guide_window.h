// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/command_line/notices.h"
#include "app/command_line/run_guide.h"
#include "ui/authoring_actions.h"

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

// What the window needs from the run. Thread-safe.
struct WindowLink {
  std::span<CommandInbox> inboxes;  // By camera.
  NoticeQueue* notices = nullptr;   // Never null.
  std::function<SavingState()> saving;
  std::function<std::vector<ui::MapFacts>()> maps;
  // From now on nothing is saved.
  std::function<void()> discard_changes;
  // Pauses recordings, or lets them go on.
  std::function<void()> toggle_pause;
  // Called with each frame once it is on the screen.
  std::function<void(const ShownFrame&)> drawn;
};

// Shows frames in a window until the frames end or the person closes it. The author's window puts commands
// into the inbox of the camera that is shown large; ui/strings.h lists its keys. With two cameras, the first
// is shown large and the other small; a click on the small image swaps them. Main thread only, as GLFW
// requires. Throws Error when there is no display.
//
// Keys of a tour: p points, k keyframes, h name of the place, d details of tracking, c or tab swap cameras,
// f11 full screen, control-q close.
void ShowInWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, FrameSlot* slot,
                  const WindowLink& link);

}  // namespace docent::app
