// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/pose_search.h"

#include <utility>

namespace docent::engine {

std::shared_ptr<const MapSnapshot> PoseSearch::MapOfHypothesis() const {
  if (hypothesis->map_key() == map_key) return map;
  const auto found = finder->FindPlaces(image.features->small_blurry, 1, 1, hypothesis->map_key());
  return found.empty() ? nullptr : found.front().map;
}

std::optional<FoundPose> ReturnToMap(const PoseSearch& search, const VerifiedPlace& found,
                                     double poor_visible_ratio, RelocalizationResult* rejection) {
  if (found.result.VisibleInlierRatio() < poor_visible_ratio) {
    search.hypothesis->Begin(found);
    *rejection = search.hypothesis->Unconfirmed(found.result);
    return std::nullopt;
  }
  search.hypothesis->Clear();
  const MapTrackResult result =
      search.pose->TryElsewhere(*search.map, search.image, found.result.camera_from_map, found.panorama,
                                MapTracker::Effort::kStandard, search.random);
  if (const RejectionReason reason = search.RejectionReasonOf(result, *search.map);
      reason != RejectionReason::kNone) {
    rejection->Consider({.rejection = reason, .map_key = search.map_key, .inliers = result.inliers});
    return std::nullopt;
  }
  return FoundPose{FoundPose::How::kReturned, search.map, search.map_key, result};
}

FoundPose EnterMap(const PoseSearch& search, std::shared_ptr<const MapSnapshot> map) {
  const MapHypothesis& hypothesis = *search.hypothesis;
  const MapTrackResult result =
      search.pose->TryElsewhere(*map, search.image, hypothesis.camera_from_map(), hypothesis.panorama(),
                                MapTracker::Effort::kStandard, search.random);
  search.hypothesis->Clear();
  return {FoundPose::How::kEntered, std::move(map), hypothesis.map_key(), result};
}

}  // namespace docent::engine
