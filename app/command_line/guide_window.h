// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "app/command_line/run_guide.h"

namespace docent::app {

// Where the camera's thread leaves frames for the window's: one place, and the newest frame takes it, so that
// a slow screen never holds the camera back.
class FrameSlot {
 public:
  void Put(std::shared_ptr<const ShownFrame> frame);
  // No more frames will come.
  void Close();
  // The newest frame not taken yet; waits up to a sixtieth of a second for one. Null when there is none.
  std::shared_ptr<const ShownFrame> Take();
  bool closed() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<const ShownFrame> frame_;
  bool closed_ = false;
};

// Shows frames in a window until they end or the person closes it; authors put commands into the inbox with
// its panel. On the main thread (GLFW's rule). Throws Error when there is no display.
//
//   escape or q  close            p  points      k  keyframes      h  status
//   control-z    undo             control-y  redo                  control-s  save
void ShowInWindow(const GuideRequest& request, const engine::CameraModel& camera, double frames_per_second,
                  FrameSlot* slot, CommandInbox* inbox);

}  // namespace docent::app
