// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "engine/map/map.h"

namespace docent::engine {

// Keeps panorama maps registered in the 3D map while their reference keyframes move (hybrid-slam §5.3).
// Constructed before the poses change; Follow() afterwards moves the dependent keyframes with their reference
// and updates the directions of the infinite points. Relative rotations within a panorama map do not change.
// For the mapper's thread.
class PanoramaRegistration {
 public:
  explicit PanoramaRegistration(const Map& map);
  void Follow(Map* map) const;

 private:
  std::map<PanoramaId, Rigid3> reference_from_map_;
};

}  // namespace docent::engine
