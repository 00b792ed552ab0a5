// SPDX-License-Identifier: Apache-2.0
#include "app/session/left_tour.h"

#include <utility>

namespace docent::app {

bool LeftTour::Update(double seconds, const cv::Mat& image, bool is_begun) {
  const bool is_left_now = idle_watch_.Update(seconds, image);
  if (is_left_now && !(asks_ && is_begun)) {
    asked_s_.reset();
    return true;
  }
  was_left_ = was_left_ || is_left_now;
  if (was_left_ && !idle_watch_.is_left()) {
    was_left_ = false;
    asked_s_ = seconds;
  }
  if (!asked_s_ || seconds - *asked_s_ < times_.answer) return false;
  asked_s_.reset();
  return true;
}

}  // namespace docent::app
