// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "app/command_line/run_guide.h"

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

// Shows frames in a window until the frames end or the person closes it. The author's panel puts commands
// into the inbox of the camera that is shown large. With two cameras, the first is shown large and the other
// small; a click on the small image swaps them. Main thread only, as GLFW requires. Throws Error when there
// is no display.
//
//   escape or q  close            p  points      k  keyframes      h  status      tab  swap cameras
//   control-z    undo             control-y  redo                  control-s  save
//   m            the map from above, coloured by how well a lost camera will be relocalized (authors only)
//
// `drawn` is called with each frame once it is on the screen.
void ShowInWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, FrameSlot* slot,
                  std::span<CommandInbox> inboxes, const std::function<void(const ShownFrame&)>& drawn);

}  // namespace docent::app
