// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Decides whether a visitor may be told where they are: only while content is drawn where it belongs. Before
// a floor of low texture a camera is followed by its rotation alone, so that content would walk along with
// the visitor. Times are those of the images, in seconds, and do not decrease. One thread.
class PlaceClaim {
 public:
  // A frame at this time.
  bool Update(double seconds, engine::TrackingState state, std::uint64_t map_key);

 private:
  // When the position was known last, in a map where it was known; empty where it never was, as in a map that
  // has no depth.
  std::optional<double> position_s_;
  std::uint64_t map_key_ = 0;
};

}  // namespace docent::app
