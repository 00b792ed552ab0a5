// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace docent::app {

// Notices that nobody uses a device: its image has hardly changed for a while, or there was none. One camera;
// one thread.
class IdleWatch {
 public:
  // The device counts as left after so long, in seconds.
  explicit IdleWatch(double idle_s) : idle_s_(idle_s) {}

  // An image (CV_8UC1 or CV_8UC3, not empty) and its time in seconds, which does not decrease. Returns true
  // once when the device has been left, and not again before it is used.
  bool Update(double seconds, const cv::Mat& image);
  // Whether the device is left at present.
  bool is_left() const { return is_left_; }

 private:
  const double idle_s_;
  cv::Mat reference_;     // Small and grey, of the last change.
  double changed_s_ = 0;  // Its time.
  double last_s_ = 0;     // Of the last image.
  bool is_left_ = false;
};

}  // namespace docent::app
