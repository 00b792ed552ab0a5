// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "content/scene.h"
#include "engine/map/local_points.h"

namespace docent::app {

// Keeps content where it was put while the map under it is adjusted: each thing stands among the points about
// it, and goes where they go. Measured from where the points were when the thing was put there, so that
// nothing adds up. One a map; the session guards it.
class ContentFollower {
 public:
  using Motions = std::vector<std::pair<std::string, engine::Sim3>>;

  // The similarities in the map that take things, by name, from where they stand in `before` to where they
  // belong in `now`; what has not moved is not among them. A thing that an edit has put elsewhere since the
  // last call belongs where it is in `before`.
  Motions Follow(const content::Scene& scene, const engine::MapSnapshot& before,
                 const engine::MapSnapshot& now);

 private:
  struct Anchor {
    engine::LocalPoints points;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // of the thing, as the last call left it
    engine::Sim3 motion;                              // of the points, up to the last call
  };
  std::map<std::string, Anchor> anchors_;
};

// The scene with these motions carried out.
std::shared_ptr<const content::Scene> Moved(const content::Scene& scene,
                                            const ContentFollower::Motions& motions);

}  // namespace docent::app
