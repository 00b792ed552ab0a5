// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "app/cameras/frame_source.h"

namespace docent::app {

struct SourceWithSize {
  std::unique_ptr<FrameSource> source;  // Delivers all images, including the one that was read for the size.
  cv::Size size;                        // Image size in pixels.
};

// Reads the first image of a source to learn the image size. Waits some ten seconds for a device that is not
// connected. Throws Error if no image arrives.
SourceWithSize ReadSize(std::unique_ptr<FrameSource> source);

}  // namespace docent::app
