// SPDX-License-Identifier: Apache-2.0
#include "app/session/load_watch.h"

#include <chrono>

namespace docent::app {

std::optional<LoadWatch::Change> LoadWatch::Add(Timestamp time, bool is_dropped) {
  // Between the two ratios nothing changes, so that a machine at its limit is not reported over and over.
  // Half of 30 images a second look smooth; a fifth is lost to a busy desktop now and then.
  constexpr double kSlow = 0.5, kGood = 0.2;
  constexpr Timestamp kInterval = std::chrono::seconds(3);
  if (!begin_) begin_ = time;
  ++images_;
  if (is_dropped) ++dropped_;
  if (time - *begin_ < kInterval) return std::nullopt;
  const Change now{.is_slow = is_slow_ ? dropped_ > kGood * images_ : dropped_ > kSlow * images_,
                   .dropped = dropped_,
                   .images = images_};
  begin_ = time;
  dropped_ = images_ = 0;
  if (now.is_slow == is_slow_) return std::nullopt;
  is_slow_ = now.is_slow;
  return now;
}

}  // namespace docent::app
