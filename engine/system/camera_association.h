// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace docent::engine {

// Decides which maps the cameras of one wearer may search (ptamm §3.3 and Fig. 7). The cameras are
// associated: all of them work in one map at a time.
//
//   - While one camera is tracked, lost cameras search its map alone, even if they see another one.
//   - When all are lost, each searches all maps.
//   - The first camera to relocalize brings the others into its map; a pose that another camera finds in a
//     different map at the same time is rejected.
//
// It does not use images and does not lock: its owner guards it. Maps are identified by their keys; 0 is
// none.
class CameraAssociation {
 public:
  explicit CameraAssociation(std::size_t cameras) : tracked_(cameras, false) {}

  // Reports that the camera is tracked in this map. Returns false, and counts the camera as lost, when other
  // cameras hold all of them in a different map.
  bool SetTracked(std::size_t camera, std::uint64_t map);
  void SetLost(std::size_t camera) { tracked_.at(camera) = false; }
  // A new map begins: no camera is tracked in it yet, and none may enter another map until one is.
  void Begin(std::uint64_t map);
  // The map was left: no camera is tracked, and all search every map.
  void Release();

  // The map that a lost camera searches; 0 for every map.
  std::uint64_t SearchedMap() const;
  // The same for one camera, which may itself be tracked: when it is the only tracked one it may enter a
  // better map, and the others follow.
  std::uint64_t SearchedMap(std::size_t camera) const;
  // The map that the cameras are in, or were in last.
  std::uint64_t map() const { return map_; }
  bool IsTracked(std::size_t camera) const { return tracked_.at(camera); }
  bool AnyTracked() const;

 private:
  std::vector<bool> tracked_;
  std::uint64_t map_ = 0;
  bool beginning_ = false;
};

}  // namespace docent::engine
