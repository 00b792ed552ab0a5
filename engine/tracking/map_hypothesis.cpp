// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/map_hypothesis.h"

#include <algorithm>

namespace docent::engine {

void MapHypothesis::Begin(std::uint64_t map_key, const Rigid3& camera_from_map, PanoramaId panorama) {
  map_key_ = map_key;
  camera_from_map_ = camera_from_map;
  panorama_ = panorama;
  frames_ = 1;
}

void MapHypothesis::Begin(const VerifiedPlace& found) {
  Begin(found.place.candidate.map_key, found.result.camera_from_map, found.panorama);
}

void MapHypothesis::Confirm(const Rigid3& camera_from_map) {
  camera_from_map_ = camera_from_map;
  ++frames_;
}

void MapHypothesis::Resume(const MapHypothesis& previous, int max_frames) {
  frames_ = std::max(frames_, std::min(frames_ + previous.frames_, max_frames));
}

Rigid3 MapHypothesis::Predict(const CameraImage& image) const {
  const auto rotation = image.RotationFromPrevious();
  return Rigid3(rotation ? *rotation : Rotation3(), Eigen::Vector3d::Zero()) * camera_from_map_;
}

bool MapHypothesis::IsOfPlace(const CameraImage& image, std::uint64_t map_key,
                              const MapTrackResult& result) const {
  return map_key == map_key_ && AreOfOnePlace(Predict(image), result.camera_from_map, result.median_depth);
}

RelocalizationResult MapHypothesis::Unconfirmed(const MapTrackResult& result) const {
  return {.rejection = RejectionReason::kUnconfirmed,
          .map_key = map_key_,
          .inliers = result.inliers,
          .frames = frames_};
}

}  // namespace docent::engine
