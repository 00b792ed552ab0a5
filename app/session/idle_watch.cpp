// SPDX-License-Identifier: Apache-2.0
#include "app/session/idle_watch.h"

#include <opencv2/imgproc.hpp>
#include <utility>

namespace docent::app {

bool IdleWatch::Update(double seconds, const cv::Mat& image) {
  // A small image, so that noise is averaged away.
  constexpr int kWidth = 32, kHeight = 24;
  constexpr double kChange =
      6;  // Mean difference in grey levels; a turn by a degree exceeds it in most rooms.
  cv::Mat small;
  cv::resize(image, small, {kWidth, kHeight}, 0, 0, cv::INTER_AREA);
  if (small.channels() == 3) cv::cvtColor(small, small, cv::COLOR_BGR2GRAY);
  const double pixels = kWidth * kHeight;
  const bool is_used = std::exchange(is_used_, false);
  const double pause_s = reference_.empty() || is_used ? 0 : seconds - last_s_;
  if (is_used) changed_s_ = seconds;
  last_s_ = seconds;
  if (reference_.empty() || cv::norm(small, reference_, cv::NORM_L1) / pixels > kChange) {
    reference_ = small;
    changed_s_ = seconds;
    return !std::exchange(is_left_, false) && pause_s >= idle_s_;
  }
  if (is_left_ || seconds - changed_s_ < idle_s_) return false;
  return is_left_ = true;
}

}  // namespace docent::app
