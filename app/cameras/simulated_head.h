// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <numbers>

#include "app/cameras/head.h"

namespace docent::app {

// An ideal pan-tilt head: 150 degrees to either side, 40 degrees down and 30 up, 60 degrees/s. Any thread.
class SimulatedHead : public Head {
 public:
  static PanTiltRange Range() {
    constexpr double kDegree = std::numbers::pi / 180;
    return {{-150 * kDegree, -40 * kDegree}, {150 * kDegree, 30 * kDegree}, 60 * kDegree};
  }

  SimulatedHead() : motion_(range_) {}
  const PanTiltRange& range() const override { return range_; }
  PanTilt At(Timestamp time) const override {
    const std::scoped_lock lock(mutex_);
    return motion_.At(time);
  }
  void LookAt(const PanTilt& wanted, Timestamp now) override {
    const std::scoped_lock lock(mutex_);
    motion_.LookAt(wanted, now);
  }

 private:
  const PanTiltRange range_ = Range();
  mutable std::mutex mutex_;
  HeadMotion motion_;
};

}  // namespace docent::app
