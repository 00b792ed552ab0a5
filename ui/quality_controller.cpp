// SPDX-License-Identifier: Apache-2.0
#include "ui/quality_controller.h"

#include <algorithm>
#include <cmath>

namespace docent::ui {

void QualityController::Begin(double now_s) {
  begin_s_ = now_s;
  frames_ = 0;
}

// The lower one of two frames in the middle.
double QualityController::Median() {
  const auto middle = times_s_.begin() + static_cast<std::ptrdiff_t>((frames_ - 1) / 2);
  std::nth_element(times_s_.begin(), middle, times_s_.begin() + static_cast<std::ptrdiff_t>(frames_));
  return *middle;
}

bool QualityController::IsToBeJudged(double now_s) const {
  constexpr std::size_t kLeastFrames = 3;
  if (now_s - begin_s_ < limits_.down_after_s) return false;
  return frames_ >= kLeastFrames ||
         (frames_ == 2 && std::min(times_s_[0], times_s_[1]) > limits_.far_too_slow_s);
}

bool QualityController::Add(double now_s, double drawing_s) {
  constexpr double kLongestWait_s = 300;
  if (begin_s_ < 0) {
    Begin(now_s - drawing_s);
    fast_since_s_ = begin_s_;
  }
  if (frames_ < times_s_.size()) times_s_[frames_++] = drawing_s;
  if (!IsToBeJudged(now_s)) return false;
  const double median_s = Median();
  Begin(now_s);
  if (median_s > limits_.fast_s) fast_since_s_ = now_s;
  if (median_s > limits_.slow_s) {
    if (level_ + 1 == kQualityLevels.size()) return false;
    if (now_s - went_up_s_ < up_after_s_) up_after_s_ = std::min(2 * up_after_s_, kLongestWait_s);
    // After the first level, one for each time that what is left has to be halved.
    const auto steps = 1 + static_cast<std::size_t>(std::log2(median_s / limits_.slow_s));
    level_ = std::min(level_ + steps, kQualityLevels.size() - 1);
    return true;
  }
  if (level_ == 0 || now_s - fast_since_s_ < up_after_s_) return false;
  --level_;
  went_up_s_ = fast_since_s_ = now_s;
  return true;
}

}  // namespace docent::ui
