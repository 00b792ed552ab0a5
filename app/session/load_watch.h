// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "engine/base/time.h"

namespace docent::app {

// Notices that a machine is too slow for the images of a camera, because most of them are dropped. One
// camera; one thread.
class LoadWatch {
 public:
  struct Change {
    bool is_slow = false;
    int dropped = 0, images = 0;  // Of the last seconds.
  };
  // An image, by the order of their times. Says when the machine becomes too slow, and when no longer.
  std::optional<Change> Add(Timestamp time, bool is_dropped);
  bool is_slow() const { return is_slow_; }

 private:
  std::optional<Timestamp> begin_;  // Of the images that are counted.
  int dropped_ = 0, images_ = 0;
  bool is_slow_ = false;
};

}  // namespace docent::app
