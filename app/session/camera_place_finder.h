// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/recognition/place.h"

namespace docent::app {

// Where one camera may look for itself in one frame: all places or those of one map (see CameraAssociation),
// and, when another camera of a known rig is tracked, first of all where this one must be. A view over the
// session's index, made for a frame and thrown away.
class CameraPlaceFinder : public engine::PlaceFinder {
 public:
  struct Prediction {
    std::uint64_t map_key = 0;
    std::shared_ptr<const engine::MapSnapshot> map;
    engine::Rigid3 camera_from_map;
  };
  // only_map 0: every map. The index must outlive this.
  CameraPlaceFinder(const engine::PlaceFinder* index, std::uint64_t only_map,
                    std::optional<Prediction> prediction)
      : index_(index), only_map_(only_map), prediction_(std::move(prediction)) {}

  // The keyframes that look most like what the prediction says lead; the rest follows by appearance.
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override;

 private:
  const engine::PlaceFinder* const index_;
  const std::uint64_t only_map_;
  const std::optional<Prediction> prediction_;
};

// Keyframes by how much of a view from `camera_from_map` they share, best first, at most `count`: near in
// position (against the depth of what they see) and near in direction.
std::vector<engine::KeyFrameId> NearestViews(const engine::MapSnapshot& map,
                                             const engine::Rigid3& camera_from_map, std::size_t count);

}  // namespace docent::app
