// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "content/edit_history.h"
#include "content/scene.h"
#include "engine/map/local_points.h"

namespace docent::app {

// Keeps content in place while its map is adjusted: each entity moves with its anchor, the map points around
// it. The motion is measured from the anchor as it was when the entity was placed, so that errors do not
// accumulate. One for each map; the session guards it.
class ContentFollower {
 public:
  using Motions = std::vector<std::pair<std::string, engine::Sim3>>;

  // The similarities, in map coordinates, that move each entity (by name) from its place in `before` to its
  // place in `now`; entities that did not move are left out. An entity that an edit moved since the last call
  // is anchored at its place in `before`.
  Motions Follow(const content::Scene& scene, const engine::MapSnapshot& before,
                 const engine::MapSnapshot& now);

 private:
  struct Anchor {
    engine::LocalPoints points;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // of the entity after the last call
    engine::Sim3 motion;                              // of the points up to the last call
  };
  std::map<std::string, Anchor> anchors_;
};

// The scene with these motions applied.
std::shared_ptr<const content::Scene> Moved(const content::Scene& scene,
                                            const ContentFollower::Motions& motions);

// Moves the content of a map from its place in `before` to that in `now`, and with it what undo and redo
// restore. Returns false if nothing moved; else the scene is a new one, also if only the history changed.
bool MoveContent(const engine::MapSnapshot& before, const engine::MapSnapshot& now, ContentFollower* follower,
                 std::shared_ptr<const content::Scene>* scene, content::EditHistory* history);

}  // namespace docent::app
