// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// How far the map about the camera has come, for whoever builds it.
enum class MappingStatus {
  kStarting,   // there is no map yet: the first two views are looked for
  kLimited,    // what is here would not hold a map: the camera is lost, or follows little or directions alone
  kExtending,  // keyframes are being added
  kMapped,     // the camera is followed well and has shown nothing new for a while
};
// starting, limited, extending, mapped.
const char* ToString(MappingStatus status);

// The status at a frame. grows: whether keyframes of this frame's map come from this session. A map counts as
// extending for two seconds after its newest keyframe.
MappingStatus MappingStatusOf(const engine::TrackedFrame& frame, bool grows);

}  // namespace docent::app
