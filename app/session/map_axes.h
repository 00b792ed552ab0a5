// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "content/scene.h"
#include "engine/map/upright_axes.h"

// Which way is up for the content of a map: as its author said (content::MapSettings), else as the keyframes
// suggest. Pure functions; any thread.
namespace docent::app {

inline Eigen::Vector3d UpOf(const content::Scene& scene, const engine::MapSnapshot& map) {
  return scene.settings.up ? *scene.settings.up : engine::UpInMap(map);
}
inline engine::UprightAxes AxesOf(const content::Scene& scene, const engine::MapSnapshot& map) {
  return scene.settings.up ? engine::UprightAxesOf(map, *scene.settings.up) : engine::UprightAxesOf(map);
}

}  // namespace docent::app
