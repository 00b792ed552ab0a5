// SPDX-License-Identifier: Apache-2.0
#include "app/session/place_claim.h"

namespace docent::app {

bool PlaceClaim::Update(double seconds, engine::TrackingState state, std::uint64_t map_key) {
  // A visitor who turns on the spot sees no error, and one who walks has gone two steps in this time.
  constexpr double kRotationAlone_s = 2;
  if (!engine::HasPose(state)) return false;
  if (map_key != map_key_) position_s_.reset();
  map_key_ = map_key;
  if (state != engine::TrackingState::kPanorama) {
    position_s_ = seconds;
    return true;
  }
  // In a map without depth, the rotation is all there is, and it draws content rightly.
  return !position_s_ || seconds - *position_s_ <= kRotationAlone_s;
}

}  // namespace docent::app
