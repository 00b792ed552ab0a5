// SPDX-License-Identifier: Apache-2.0
#include "engine/system/provisional_map.h"

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> ProvisionalMapOptions::Validate() const {
  return OptionCheck()
      .NotNegative(time, "time of a provisional map")
      .That(keyframes > 0, "A provisional map needs at least one keyframe.")
      .NotNegative(loss_time, "loss of a provisional map")
      .NotNegative(panorama_loss_time, "loss of a map without depth")
      .fault();
}

void ProvisionalMap::Begin(Timestamp started) {
  pending_ = is_young_ = true;
  started_ = started;
  monitor_ = InitializationMonitor();
}

std::optional<MapDiscarded> ProvisionalMap::Check(const ProvisionalMapOptions& options,
                                                  const Observation& seen) {
  const Timestamp now = seen.frame.frame.time;
  const auto is_lost_for = [&](Timestamp duration) {
    return seen.lost_since && now - *seen.lost_since > duration;
  };
  MapDiscarded reason;
  if (seen.may_extend && seen.map && !seen.map->HasFinitePoints()) {
    // A map without finite points is quickly made again. One that gets them just now may find the camera.
    if (seen.starting || !is_lost_for(options.panorama_loss_time)) return std::nullopt;
    if (!seen.may_discard) {
      pending_ = false;
      return std::nullopt;
    }
    reason.reason = MapDiscarded::Reason::kLostWithoutDepth;
    return reason;
  }
  if (now - started_ > options.time) is_young_ = false;
  if (!pending_ && !is_young_) return std::nullopt;
  if (seen.in_map) monitor_.Add(seen.frame);
  auto fault = is_young_ ? monitor_.FindJump() : std::nullopt;
  if (!fault && pending_) fault = monitor_.FindFault();
  if (fault && seen.may_discard) {
    reason.reason = MapDiscarded::Reason::kFalseDepth;
    reason.fault = *fault;
    return reason;
  }
  if (!pending_) return std::nullopt;
  if (!seen.lost_since) {
    if (now - started_ > options.time || seen.map->keyframes.size() >= options.keyframes) pending_ = false;
    return std::nullopt;
  }
  if (!is_lost_for(options.loss_time)) return std::nullopt;
  if (!seen.may_discard) {
    pending_ = false;
    return std::nullopt;
  }
  reason.reason = MapDiscarded::Reason::kLostWhileProvisional;
  reason.tracked_for = *seen.lost_since - started_;
  reason.keyframes = seen.map->keyframes.size();
  return reason;
}

}  // namespace docent::engine
