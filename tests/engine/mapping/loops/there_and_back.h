// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>

#include "tests/engine/mapping/loops/gallery.h"

// A camera goes along the gallery and comes back. On its way back it has drifted and maps everything a second
// time, so that the map contains a loop that is not closed. For tests.
namespace docent::engine::testing_world {

// Keyframes 0 to 8 of the map are those of the way out, 9 to 16 those of the way back. The way out is mapped
// where it is; the way back is mapped elsewhere by the drift.
inline constexpr std::array<double, 9> kPlacesOut = {0, 0.2, 0.4, 0.6, 1.1, 1.6, 2.1, 2.6, 3.1};
inline constexpr std::array<double, 8> kPlacesBack = {2.9, 2.4, 1.9, 1.4, 0.9, 0.5, 0.3, 0.1};
// The keyframes near the beginning, where the camera returns last, and the keyframes of the beginning.
inline constexpr std::array<KeyFrameId, 3> kReturned = {14, 15, 16};
inline constexpr std::array<KeyFrameId, 4> kBeginning = {0, 1, 2, 3};

inline std::shared_ptr<const MapSnapshot> MapOfPlaces(const RenderedWorld& gallery,
                                                      std::span<const double> places) {
  std::vector<Rigid3> poses;
  for (const double x : places) poses.push_back(InTheGallery(x));
  return MapOfGallery(gallery, poses).Snapshot();
}
inline const std::shared_ptr<const MapSnapshot>& WayOut() {
  static const auto map = MapOfPlaces(VariedGallery(), kPlacesOut);
  return map;
}
inline const std::shared_ptr<const MapSnapshot>& WayBack() {
  static const auto map = MapOfPlaces(VariedGallery(), kPlacesBack);
  return map;
}

inline Map ThereAndBack(const Sim3& drift) {
  return MapOfStretches(std::array<Stretch, 2>{{{WayOut(), {}}, {WayBack(), drift}}});
}
// The true pose of a keyframe of that map.
inline Rigid3 TruePoseThereAndBack(KeyFrameId id) {
  return id < kPlacesOut.size() ? WayOut()->keyframes[id].camera_from_map
                                : WayBack()->keyframes[id - kPlacesOut.size()].camera_from_map;
}

// A drift that a loop corrects: two degrees, a tenth of a metre and eight per cent of scale.
inline Sim3 SmallDrift() {
  return {Rotation3::Exp({0.01, -0.03, 0.02}), {0.1, 0.03, 0.05}, 1.08};
}

}  // namespace docent::engine::testing_world
