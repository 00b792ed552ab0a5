// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_director.h"

#include <algorithm>
#include <utility>

namespace docent::app {

namespace {

constexpr double kLeaveRatio = 1.2;        // Of the range.
constexpr double kMinCaption_seconds = 3;  // A short sound's caption is shown long enough to be read.

}  // namespace

bool SoundDirector::IsHeard(const content::Sound& sound, const Eigen::Vector3d& camera, bool was_near) const {
  return (camera - sound.position).norm() <= sound.range * (was_near ? kLeaveRatio : 1);
}

void SoundDirector::BeginAnew() {
  for (const auto& [key, left] : std::exchange(near_, {})) left_.push_back(key);
  asked_.clear();
}

SoundDirector::Orders SoundDirector::Update(double seconds, std::uint64_t map_key,
                                            const content::Scene& scene,
                                            const std::optional<Eigen::Vector3d>& camera_in_map) {
  Orders orders;
  orders.stop = std::exchange(left_, {});
  if (camera_in_map) {
    const std::set<Key> asked = std::exchange(asked_, {});
    std::map<Key, Near> near;
    for (const content::Entity& entity : scene.entities) {
      if (entity.kind != content::Entity::Kind::kSound || entity.hidden) continue;
      const Key key(map_key, entity.name);
      const auto before = near_.find(key);
      const bool begins = asked.contains(key);
      const bool goes_on =
          before != near_.end() && before->second.is_asked && seconds < before->second.end_seconds;
      if (!begins && !goes_on && !IsHeard(entity.sound, *camera_in_map, before != near_.end())) continue;
      Near now;
      now.caption = content::ShownText(entity, language_);
      now.is_asked = begins || goes_on;
      if (begins && before != near_.end()) {
        orders.stop.push_back(key);
        near_.erase(before);
      }
      if (!begins && before != near_.end()) {
        now.end_seconds = before->second.end_seconds;
        near_.erase(before);
      } else {
        now.end_seconds = seconds + std::max(entity.sound.asset->seconds, kMinCaption_seconds);
        orders.start.emplace_back(key, entity.sound.asset);
      }
      near.emplace(key, std::move(now));
    }
    for (const auto& [key, left] : near_) orders.stop.push_back(key);
    near_ = std::move(near);
  }
  for (const auto& [key, sound] : near_) {
    if (seconds >= sound.end_seconds || sound.caption.empty()) continue;
    orders.caption += (orders.caption.empty() ? "" : "\n") + sound.caption;
  }
  return orders;
}

}  // namespace docent::app
