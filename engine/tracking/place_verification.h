// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "engine/tracking/place_retrieval.h"
#include "engine/tracking/pose_criteria.h"

namespace docent::engine {

// Whether two poses in one map are two estimates of one place and not different places. depth: median depth
// of what the camera sees there.
bool AreOfOnePlace(const Rigid3& camera_from_map, const Rigid3& other_from_map, double depth);

// A place whose pose was verified in the image.
struct VerifiedPlace {
  AlignedPlace place;
  MapTrackResult result;
  PanoramaId panorama = kNoId;
};

// Verifies candidates geometrically, each by searching its map's points from the pose that it suggests, and
// compares the best one with others that explain the image too (ptamm §5.3). Owns the map tracker for this,
// so that the track of the camera is not disturbed. Used on the camera's thread.
class PlaceVerification {
 public:
  // The present frame. All pointers are valid during one call.
  struct Query {
    const CameraImage& image;
    const PlaceFinder& finder;
    PatchComparison comparison = PatchComparison::kStandard;
    Random* random = nullptr;
    RelocalizationResult* rejection = nullptr;  // receives the rejections
  };

  PlaceVerification(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera);
  void SetRim(const RimMask* rim) { tracker_.SetRim(rim); }
  void SetCamera(std::shared_ptr<const CameraModel> camera) { tracker_.SetCamera(std::move(camera)); }

  // The first place that is verified in the image, or a better one in the same map, and the best verified
  // place of a competing map; the better one first. Empty if the best-to-second ratio in the map is too
  // small.
  std::vector<VerifiedPlace> Verify(const Query& query, const std::vector<AlignedPlace>& places);
  // The best other place of the map that is verified with a different pose.
  std::optional<VerifiedPlace> BestElsewhere(const Query& query, std::uint64_t map_key,
                                             const Rigid3& camera_from_map, KeyFrameId excluded_keyframe);
  // The best place that is verified in a map outside `excluded_maps`.
  std::optional<VerifiedPlace> BestCompetingMap(const Query& query, const std::vector<AlignedPlace>& places,
                                                std::set<std::uint64_t> excluded_maps);
  // The result of one place, whether or not it is accepted.
  VerifiedPlace Try(const Query& query, const AlignedPlace& place);
  // Continues a hypothesis from its predicted pose.
  MapTrackResult Continue(const Query& query, const MapSnapshot& map, const Rigid3& predicted,
                          PanoramaId panorama);

 private:
  // Replaces *found by the best place of its map; false if the best-to-second ratio in the map is too small.
  bool ReplaceByBetterPlace(const Query& query, VerifiedPlace* found);

  TrackerOptions options_;
  PoseCriteria criteria_;
  MapTracker tracker_;
};

}  // namespace docent::engine
