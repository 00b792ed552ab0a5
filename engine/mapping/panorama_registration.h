// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "engine/map/map.h"

namespace docent::engine {

// Keeps panorama maps registered in the 3D map while their reference keyframes are moved (hybrid-slam §5.3):
// made before the poses change, Follow() afterwards moves the dependent keyframes with their reference, and
// turns the infinite points to where the keyframes now see them. Rotations within a panorama map stay as they
// are. For the mapper's thread.
class PanoramaRegistration {
 public:
  explicit PanoramaRegistration(const Map& map);
  void Follow(Map* map) const;

 private:
  std::map<PanoramaId, Rigid3> reference_from_map_;
};

}  // namespace docent::engine
