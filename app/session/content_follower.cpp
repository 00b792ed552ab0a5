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

bool MoveContent(const engine::MapSnapshot& before, const engine::MapSnapshot& now, ContentFollower* follower,
                 std::shared_ptr<const content::Scene>* scene, content::EditHistory* history) {
  // More than anybody undoes one after the other; each costs a fraction of a millisecond.
  constexpr std::size_t kMostAbsent = 100;
  const std::vector<content::AbsentEntity> absent = history->Absent(kMostAbsent);
  if ((*scene)->entities.empty() && absent.empty()) return false;
  content::Scene all = **scene;
  // No entity has such a name, and each gets another one, because some were removed under the same name.
  std::map<std::string, const content::AbsentEntity*> by_name;
  for (const content::AbsentEntity& one : absent) {
    content::Entity& entity = all.entities.emplace_back(one.entity);
    entity.name = '\n' + std::to_string(by_name.size());
    by_name[entity.name] = &one;
  }
  const ContentFollower::Motions motions = follower->Follow(all, before, now);
  if (motions.empty()) return false;
  *scene = Moved(**scene, motions);
  for (const auto& [name, motion] : motions) {
    if (const auto found = by_name.find(name); found != by_name.end()) {
      history->MoveWithAnchor(*found->second, motion);
    } else {
      history->MoveWithAnchor(name, motion);
    }
  }
  return true;
}

}  // namespace docent::app
