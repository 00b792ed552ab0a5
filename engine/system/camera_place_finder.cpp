// SPDX-License-Identifier: Apache-2.0
#include "engine/system/camera_place_finder.h"

#include <algorithm>
#include <utility>

namespace docent::engine {

std::vector<KeyFrameId> NearestViews(const MapSnapshot& map, const Rigid3& camera_from_map,
                                     std::size_t count) {
  std::vector<std::pair<double, KeyFrameId>> ranked;
  const Eigen::Vector3d center = camera_from_map.OriginInSource();
  for (const KeyFrame& keyframe : map.keyframes) {
    const double depth = std::max(1e-9, keyframe.mean_depth);
    const double shift = (keyframe.camera_from_map.OriginInSource() - center).norm() / depth;
    const double turn = (keyframe.camera_from_map.rotation * camera_from_map.rotation.inverse()).Angle();
    ranked.emplace_back(shift + turn, keyframe.id);
  }
  count = std::min(count, ranked.size());
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count), ranked.end());
  std::vector<KeyFrameId> nearest;
  for (std::size_t i = 0; i < count; ++i) nearest.push_back(ranked[i].second);
  return nearest;
}

std::vector<PlaceCandidate> CameraPlaceFinder::FindPlaces(const PlaceQuery& query, int count, int per_map,
                                                          std::uint64_t only_map) const {
  const std::uint64_t searched = only_map_ != 0 ? only_map_ : only_map;
  // The caller asks for a map that this camera may not search.
  if (only_map != 0 && searched != only_map) return {};
  std::vector<PlaceCandidate> found = index_->FindPlaces(query, count, per_map, searched);
  if (!prediction_ || (searched != 0 && searched != prediction_->map_key)) return found;
  std::vector<PlaceCandidate> places;
  const auto has = [&](const PlaceCandidate& place) {
    return std::any_of(places.begin(), places.end(), [&](const PlaceCandidate& other) {
      return other.map_key == place.map_key && other.keyframe == place.keyframe;
    });
  };
  const auto most = static_cast<std::size_t>(std::min(count, per_map));
  for (const KeyFrameId id : NearestViews(*prediction_->map, prediction_->camera_from_map, most)) {
    places.push_back({prediction_->map_key, prediction_->map, id, 0});
  }
  for (PlaceCandidate& place : found) {
    if (places.size() < static_cast<std::size_t>(count) && !has(place)) places.push_back(std::move(place));
  }
  return places;
}

}  // namespace docent::engine
