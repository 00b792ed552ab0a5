// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "app/cameras/frame_source.h"

namespace docent::app {

// The images of `source` from `from` on and before `until`, both counted from its first image. Times and
// indices stay as they are. An `until` of zero means to the end.
std::unique_ptr<FrameSource> ClipSource(std::unique_ptr<FrameSource> source, Timestamp from, Timestamp until);

// The images of a recorded source from the one of number `first_frame` (from 0) on, for less than
// `duration` or, where that is zero, to the end, as if the recording began there: times stay as they are,
// indices begin at 0.
std::unique_ptr<FrameSource> WindowOf(std::unique_ptr<FrameSource> source, std::uint64_t first_frame,
                                      Timestamp duration);

}  // namespace docent::app
