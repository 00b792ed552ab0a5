// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "app/cameras/frame_source.h"

namespace docent::app {

// The pictures of `source` from `from` on and before `until`, both counted from its first picture. Times and
// indices stay as they are. An `until` of zero means to the end.
std::unique_ptr<FrameSource> ClipSource(std::unique_ptr<FrameSource> source, Timestamp from, Timestamp until);

}  // namespace docent::app
