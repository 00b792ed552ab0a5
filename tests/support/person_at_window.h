// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <utility>

namespace docent {

// A person at a window named "Docent" whose frames the test draws. A key and a button are held for a number
// of frames and not for a time: how long a frame takes depends on the load.
class PersonAtWindow {
 public:
  explicit PersonAtWindow(std::function<void()> draw) : draw_(std::move(draw)) {}

  // With modifiers, as in "ctrl+q". Without a window manager, the window has the keyboard only if it is given
  // to it.
  void Press(const std::string& key) {
    Act("search --name Docent windowfocus");
    Act("keydown " + key);
    Act("keyup " + key);
  }
  // Presses and releases keys, separated by spaces, while no frame is drawn.
  void PressBetweenFrames(const std::string& keys) {
    Act("search --name Docent windowfocus");
    const std::string xdotool = "key --delay 20 " + keys;
    EXPECT_EQ(std::system(("xdotool " + xdotool).c_str()), 0) << xdotool;
  }
  void Type(const std::string& text) {
    Act("search --name Docent windowfocus sleep 0.1 type --delay 60 " + text);
  }
  // Without a window manager, the window's corner is the screen's corner.
  void Click(const Eigen::Vector2d& point) {
    Act("mousemove " + std::to_string(std::lround(point.x())) + " " + std::to_string(std::lround(point.y())));
    Act("mousedown 1");
    Act("mouseup 1");
  }

 private:
  // Draws while the person acts, and then as many frames as the window needs to answer. The words are those
  // of xdotool.
  void Act(const std::string& xdotool) {
    constexpr int kFramesAfter = 5;
    std::atomic<bool> done = false;
    std::thread hand([&] {
      EXPECT_EQ(std::system(("xdotool " + xdotool).c_str()), 0) << xdotool;
      done = true;
    });
    while (!done) {
      draw_();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    hand.join();
    for (int i = 0; i < kFramesAfter; ++i) draw_();
  }

  std::function<void()> draw_;
};

}  // namespace docent
