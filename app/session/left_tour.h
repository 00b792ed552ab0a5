// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "app/session/idle_watch.h"

namespace docent::app {

// Makes sure that nobody goes on unasked with a tour that its visitor has left. When a device that was left
// is used again, its visitor is asked whether the tour goes on; without an answer it begins anew. One camera;
// one thread.
class LeftTour {
 public:
  struct Times {
    double left = 300;   // A device counts as left after this long, seconds: longer than a rest on a bench.
    double answer = 20;  // How long an answer is waited for, seconds: enough to read the question twice.
  };
  // `asks`: false where nobody is asked, and a tour that was left begins anew at once.
  LeftTour(const Times& times, bool asks) : times_(times), asks_(asks), idle_watch_(times.left) {}

  // An image (as for IdleWatch) and its time in seconds, which does not decrease. `is_begun`: the next
  // visitor would take something over. Returns true when the tour is to begin anew.
  bool Update(double seconds, const cv::Mat& image, bool is_begun);
  // The visitor did something with the device, by touch or keys. Where the camera is fixed, its image does
  // not show it.
  void Use() { idle_watch_.Use(); }
  // Whether the visitor is to be asked at present.
  bool is_asking() const { return asked_s_.has_value(); }
  // Whether nobody uses the device, or its visitor has yet to say whether the tour goes on.
  bool is_between_visits() const { return idle_watch_.is_left() || is_asking(); }
  // The visitor has decided.
  void Answer() {
    asked_s_.reset();
    was_left_ = false;
  }

 private:
  const Times times_;
  const bool asks_;
  IdleWatch idle_watch_;
  bool was_left_ = false;          // Since then the device was not used.
  std::optional<double> asked_s_;  // Since when the visitor is asked.
};

}  // namespace docent::app
