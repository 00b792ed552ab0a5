// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/tracked_frame.h"

namespace docent::engine {

const char* ToString(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "initializing";
    case TrackingState::kSixDof:
      return "sixdof";
    case TrackingState::kHybrid:
      return "hybrid";
    case TrackingState::kPanorama:
      return "panorama";
    case TrackingState::kLost:
      return "lost";
    case TrackingState::kRelocalized:
      return "relocalized";
    case TrackingState::kDropped:
      return "dropped";
  }
  return "unknown";
}

bool HasPose(TrackingState state) {
  return state == TrackingState::kSixDof || state == TrackingState::kHybrid ||
         state == TrackingState::kPanorama || state == TrackingState::kRelocalized;
}

}  // namespace docent::engine
