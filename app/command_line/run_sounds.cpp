// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_sounds.h"

namespace docent::app {

RunSounds::RunSounds(const GuideRequest& request)
    : waits_for_screen_(!request.may_write && !request.headless), director_(request.language) {
  if (request.sound) player_.emplace();
}

std::vector<Event> RunSounds::Add(ShownFrame* frame, std::span<const SoundDirector::Key> asked) {
  if (std::exchange(visitors_before_, frame->visitors_before) != frame->visitors_before)
    director_.BeginAnew();
  for (const auto& [map_key, name] : asked) director_.Ask(map_key, name);
  static const content::Scene kNoScene;
  const engine::TrackedFrame& tracked = frame->tracked;
  // A visitor's pose that is not believed (see VisitorGuide) has no content, or that of the last pose before.
  const bool is_believed = frame->shown.scene && !frame->held_camera_from_map;
  std::optional<Eigen::Vector3d> place;
  if (engine::HasPose(tracked.state) && is_believed) place = tracked.camera_from_map.OriginInSource();
  SoundDirector::Orders orders = director_.Update(frame->seconds, tracked.map_key,
                                                  frame->shown.scene ? *frame->shown.scene : kNoScene, place);
  frame->caption = orders.caption;
  std::vector<Event> events;
  for (const auto& [key, asset] : orders.start)
    events.push_back({tracked.frame.time, "sound", "'" + key.second + "' begins"});
  if (!player_) return events;
  if (!waits_for_screen_) {
    player_->Give(orders);
  } else if (!orders.start.empty() || !orders.stop.empty()) {
    undrawn_.emplace_back(tracked.frame.index, std::move(orders));
  }
  return events;
}

void RunSounds::HandleShown(std::uint64_t index) {
  while (!undrawn_.empty() && undrawn_.front().first <= index) {
    player_->Give(undrawn_.front().second);
    undrawn_.pop_front();
  }
}

std::string RunSounds::TakeProblem() {
  return player_ ? player_->TakeProblem() : std::string();
}

}  // namespace docent::app
