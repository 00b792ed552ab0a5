// SPDX-License-Identifier: Apache-2.0
#include "app/session/mapping_status.h"

#include "engine/base/time.h"

namespace docent::app {

const char* ToString(MappingStatus status) {
  switch (status) {
    case MappingStatus::kStarting:
      return "starting";
    case MappingStatus::kLimited:
      return "limited";
    case MappingStatus::kExtending:
      return "extending";
    case MappingStatus::kMapped:
      return "mapped";
  }
  return "";
}

MappingStatus MappingStatusOf(const engine::TrackedFrame& frame, bool extended) {
  using engine::TrackingState;
  constexpr Timestamp kExtendingFor = std::chrono::seconds(2);
  if (frame.state == TrackingState::kInitializing) return MappingStatus::kStarting;
  const bool tracked_well = engine::HasPose(frame.state) && frame.state != TrackingState::kPanorama &&
                            frame.quality_class == engine::TrackingQuality::kGood;
  if (!tracked_well || !frame.map || frame.map->keyframes.empty()) return MappingStatus::kLimited;
  const Timestamp since = frame.frame.time - frame.map->keyframes.back().time;
  const bool extending = extended && since >= Timestamp{} && since < kExtendingFor;
  return extending ? MappingStatus::kExtending : MappingStatus::kMapped;
}

}  // namespace docent::app
