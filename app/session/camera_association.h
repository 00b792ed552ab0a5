// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace docent::app {

// Which maps the cameras of one wearer may look in (ptamm §3.3 and Fig. 7). They are associated: all work in
// one map at a time.
//
//   - While one of them is tracked, those that are lost look for themselves in its map alone, even if they
//   see
//     another one.
//   - When all are lost, each searches everything.
//   - The first to be found again calls the others into its map; whoever is found elsewhere at the same
//     moment is not believed.
//
// Knows nothing of images and keeps no lock: its owner guards it. Maps are named by their keys; 0 is none.
class CameraAssociation {
 public:
  explicit CameraAssociation(std::size_t cameras) : tracked_(cameras, false) {}

  // The camera says that it is tracked in this map. False when it may not be, because another one holds all
  // of them in another map; it then counts as lost.
  bool Tracked(std::size_t camera, std::uint64_t map);
  void Lost(std::size_t camera) { tracked_.at(camera) = false; }
  // A map begins: nobody is tracked in it yet, and nobody may wander off to another one until somebody is.
  void Begin(std::uint64_t map);
  // The map was left: nobody is tracked, and all search everything.
  void Release();

  // Where a camera that is lost looks for itself: this map alone, or every map when 0.
  std::uint64_t SearchedMap() const;
  // The same for one of the cameras: by itself it may leave for a map that fits better, and the others come.
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

}  // namespace docent::app
