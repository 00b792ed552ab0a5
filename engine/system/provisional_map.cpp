// SPDX-License-Identifier: Apache-2.0
#include "engine/system/provisional_map.h"

#include <algorithm>

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
  monitors_.clear();
}

InitializationMonitor& ProvisionalMap::MonitorOf(int camera) {
  const auto index = static_cast<std::size_t>(camera);
  if (index >= monitors_.size()) monitors_.resize(index + 1);
  return monitors_[index];
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
  InitializationMonitor& monitor = MonitorOf(seen.frame.frame.camera);
  if (seen.in_map) monitor.Add(seen.frame);
  auto fault = is_young_ ? monitor.FindJump() : std::nullopt;
  if (!fault && pending_) fault = monitor.FindFault();
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
  // A loss while the mapper made the map does not count.
  const Timestamp lost_since = std::max(*seen.lost_since, started_);
  if (now - lost_since <= options.loss_time) return std::nullopt;
  if (!seen.may_discard) {
    pending_ = false;
    return std::nullopt;
  }
  reason.reason = MapDiscarded::Reason::kLostWhileProvisional;
  reason.tracked_for = lost_since - started_;
  reason.keyframes = seen.map->keyframes.size();
  return reason;
}

}  // namespace docent::engine
