// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// State of the map around the camera, for the user who builds it.
enum class MappingStatus {
  kStarting,   // there is no map yet: two initial views are being searched
  kLimited,    // the map cannot be extended: tracking is lost, poor or rotation-only
  kExtending,  // keyframes are being added
  kMapped,     // tracking is good and no keyframe was added recently
};
// "starting", "limited", "extending" or "mapped"; the user interface shows a sentence for each.
const char* ToString(MappingStatus status);

// The status of a frame. extended: whether this session adds keyframes to the frame's map. A map counts as
// extending for two seconds after its newest keyframe.
MappingStatus MappingStatusOf(const engine::TrackedFrame& frame, bool extended);

}  // namespace docent::app
