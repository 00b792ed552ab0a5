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

// Where the cameras' threads leave frames for the window's: one place for each camera, and its newest frame
// takes it, so that a slow screen never holds a camera back.
class FrameSlot {
 public:
  explicit FrameSlot(std::size_t cameras) : frames_(cameras) {}
  void Put(std::shared_ptr<const ShownFrame> frame);
  // No more frames will come.
  void Close();
  // The newest frames not taken yet, by camera; waits up to a sixtieth of a second for one. Null where there
  // is none.
  std::vector<std::shared_ptr<const ShownFrame>> Take();
  bool closed() const;

 private:
  bool HasFrame() const;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<const ShownFrame>> frames_;
  bool closed_ = false;
};

// Shows frames in a window until they end or the person closes it; authors put commands into the inbox of the
// frame's camera with its panel. With two cameras the first is shown large and the other small; a click on
// the small image swaps them. On the main thread (GLFW's rule). Throws Error when there is no display.
//
//   escape or q  close            p  points      k  keyframes      h  status      tab  swap cameras
//   control-z    undo             control-y  redo                  control-s  save
//   m            the map about the camera from above, with colours that say where lost visitors will be found
//                (authors)
//
// drawn is told of every frame once it is on the screen.
void ShowInWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, FrameSlot* slot,
                  std::span<CommandInbox> inboxes, const std::function<void(const ShownFrame&)>& drawn);

}  // namespace docent::app
