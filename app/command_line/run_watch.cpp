// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_watch.h"

namespace docent::app {

RunWatch::Notices RunWatch::Add(const engine::TrackedFrame& tracked) {
  Notices notices;
  const auto camera = static_cast<std::size_t>(tracked.frame.camera);
  WatchLoad(camera, tracked, &notices);
  WatchPair(camera, tracked, &notices);
  return notices;
}

void RunWatch::WatchLoad(std::size_t camera, const engine::TrackedFrame& tracked, Notices* notices) {
  const bool is_dropped = tracked.state == engine::TrackingState::kDropped;
  const auto change = loads_[camera].Add(tracked.frame.time, is_dropped);
  if (!change) return;
  const std::string counts = std::to_string(change->dropped) + " of " + std::to_string(change->images) +
                             " images were skipped in the last seconds";
  notices->events.push_back({tracked.frame.time, "load",
                             change->is_slow ? counts + "; the machine is too slow to track more"
                                             : "the machine is fast enough again: " + counts});
  if (change->is_slow && camera == 0) notices->sentence = strings_.device_is_slow;
}

void RunWatch::WatchPair(std::size_t camera, const engine::TrackedFrame& tracked, Notices* notices) {
  // While a map is started, no camera is anywhere.
  if (cameras_.size() != 2 || tracked.state == engine::TrackingState::kDropped ||
      tracked.state == engine::TrackingState::kInitializing)
    return;
  if (!pair_.Update(camera, ToSeconds(tracked.frame.time), engine::HasPose(tracked.state))) return;
  notices->events.push_back({tracked.frame.time, "warning",
                             "Camera '" + cameras_[camera] +
                                 "' has not been recognized for half a minute where the other camera is; are "
                                 "both worn together?"});
  notices->sentence = strings_.cameras_apart;
}

}  // namespace docent::app
