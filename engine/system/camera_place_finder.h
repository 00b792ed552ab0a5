// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/recognition/place.h"

namespace docent::engine {

// The places that one camera may search in one frame: those of all maps or of one map (see
// CameraAssociation). When another camera of a rigid rig is tracked, the keyframes near the predicted pose
// come first. A view of the session's index, made for one frame.
class CameraPlaceFinder : public PlaceFinder {
 public:
  struct Prediction {
    std::uint64_t map_key = 0;
    std::shared_ptr<const MapSnapshot> map;
    Rigid3 camera_from_map;
  };
  // only_map 0 means every map. The index must outlive this.
  CameraPlaceFinder(const PlaceFinder* index, std::uint64_t only_map, std::optional<Prediction> prediction)
      : index_(index), only_map_(only_map), prediction_(std::move(prediction)) {}

  // Returns the keyframes nearest to the prediction first, then those found by appearance.
  std::vector<PlaceCandidate> FindPlaces(const PlaceQuery& query, int count, int per_map,
                                         std::uint64_t only_map) const override;

 private:
  const PlaceFinder* const index_;
  const std::uint64_t only_map_;
  const std::optional<Prediction> prediction_;
};

// At most `count` keyframes ranked by the distance of their position (in units of their median depth) plus
// the angle (radians) between the views, nearest first.
std::vector<KeyFrameId> NearestViews(const MapSnapshot& map, const Rigid3& camera_from_map,
                                     std::size_t count);

}  // namespace docent::engine
