// SPDX-License-Identifier: Apache-2.0
#include "app/session/content_follower.h"

#include <algorithm>
#include <cmath>

namespace docent::app {

namespace {

// Enough points that the noise of single points, which later observations reduce, neither shifts nor tilts
// the entity among them.
constexpr std::size_t kAnchorPoints = 150;
// Ratio of the distance to the points; smaller motion is not visible.
constexpr double kMinMotion = 1e-5;

// Size of the motion at `place`: the largest of shift over `reach`, rotation angle and scale change.
double RelativeMotion(const engine::Sim3& motion, const Eigen::Vector3d& place, double reach) {
  return std::max(
      {(motion * place - place).norm() / reach, motion.rotation.Angle(), std::abs(motion.scale - 1)});
}

}  // namespace

ContentFollower::Motions ContentFollower::Follow(const content::Scene& scene,
                                                 const engine::MapSnapshot& before,
                                                 const engine::MapSnapshot& now) {
  std::erase_if(anchors_, [&](const auto& entry) { return scene.Find(entry.first) == nullptr; });
  Motions motions;
  for (const content::Entity& entity : scene.entities) {
    const Eigen::Vector3d place = content::PlaceOf(entity);
    Anchor& anchor = anchors_[entity.name];
    if (anchor.points.ids.empty() || !anchor.place.isApprox(place, 1e-9))
      anchor = {engine::NearestPoints(before, place, kAnchorPoints), place, {}};
    const auto motion = engine::EstimateMotion(anchor.points, now);
    if (!motion) {
      anchors_.erase(entity.name);  // the next call anchors it to the points that exist then
      continue;
    }
    const engine::Sim3 step = *motion * anchor.motion.inverse();
    double reach = 0;
    for (const Eigen::Vector3d& position : anchor.points.positions)
      reach = std::max(reach, (anchor.motion * position - place).norm());
    if (RelativeMotion(step, place, reach) < kMinMotion) continue;
    anchor.motion = *motion;
    anchor.place = step * place;
    motions.emplace_back(entity.name, step);
  }
  return motions;
}

std::shared_ptr<const content::Scene> Moved(const content::Scene& scene,
                                            const ContentFollower::Motions& motions) {
  auto moved = std::make_shared<content::Scene>(scene);
  for (const auto& [name, motion] : motions) {
    for (content::Entity& entity : moved->entities) {
      if (entity.name == name) content::MoveWithAnchor(motion, &entity);
    }
  }
  return moved;
}

}  // namespace docent::app
