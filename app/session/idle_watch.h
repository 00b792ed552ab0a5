// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace docent::app {

// Notices that nobody uses a device: for a while its image has hardly changed, or there was none, and nobody
// did anything with it. One camera; one thread.
class IdleWatch {
 public:
  // The device counts as left after this long, in seconds.
  explicit IdleWatch(double idle_s) : idle_s_(idle_s) {}

  // An image (CV_8UC1 or CV_8UC3, not empty) and its time in seconds, which does not decrease. Returns true
  // once when the device has been left, and not again before it is used.
  bool Update(double seconds, const cv::Mat& image);
  // Somebody did something with the device since the last image; there may be none for a long time.
  void Use() {
    is_used_ = true;
    is_left_ = false;
  }
  // Whether the device is left at present.
  bool is_left() const { return is_left_; }

 private:
  const double idle_s_;
  cv::Mat reference_;     // Small and grey, of the last change of the image.
  double changed_s_ = 0;  // Its time, or when the device was used since.
  double last_s_ = 0;     // Of the last image.
  bool is_used_ = false;  // Since the last image.
  bool is_left_ = false;
};

}  // namespace docent::app
