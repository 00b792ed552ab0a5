// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "app/cameras/frame_source.h"

namespace docent::app {

// Delivers the images of `source` in the interval [from, until), relative to its first image. Timestamps and
// indices are unchanged. An `until` of zero means the end of the source. Throws
// Error if `from` is beyond the end: here if the source knows its duration, else when its images have been
// read.
std::unique_ptr<FrameSource> ClipSource(std::unique_ptr<FrameSource> source, Timestamp from, Timestamp until);

// Delivers the images of a recorded source as if the recording began at image `first_frame` (from 0), for
// less than `duration`, or to the end if `duration` is zero. Timestamps are unchanged; indices begin at 0. If
// there is no such image, Next throws Error when all images have been read.
std::unique_ptr<FrameSource> WindowOf(std::unique_ptr<FrameSource> source, std::uint64_t first_frame,
                                      Timestamp duration);

}  // namespace docent::app
