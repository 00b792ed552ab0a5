// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// One image as delivered by a camera. The pixels are not modified once they are in a Frame.
struct Frame {
  Timestamp time{};         // on the clock of the source; increases strictly for each camera
  int camera = 0;           // index in the session
  std::uint64_t index = 0;  // counts the images of this camera, including dropped ones
  cv::Mat image;            // CV_8UC3 (BGR) or CV_8UC1
  // The rotation now_from_previous that was commanded to a motorised head since the previous image; empty if
  // there was none.
  std::optional<Rotation3> commanded_rotation;
};

}  // namespace docent::engine
