// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "engine/tracking/map_hypothesis.h"
#include "engine/tracking/place_verification.h"
#include "engine/tracking/pose_tracker.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::engine {

// One frame of a camera that looks for its pose in known maps: because it is lost (Relocalizer), or because
// another map or place may fit better (BetterMapSearch). The parts are those of its tracker and are valid
// while the frame is processed.
struct PoseSearch {
  const CameraImage& image;
  const PlaceFinder* finder = nullptr;     // null: only in the present map
  std::shared_ptr<const MapSnapshot> map;  // that the camera is in, or was in before the loss; may be null
  std::uint64_t map_key = 0;
  const KeyFramePolicy& policy;
  const PoseCriteria& criteria;
  PoseTracker* pose = nullptr;
  PlaceRetrieval* retrieval = nullptr;
  PlaceVerification* verification = nullptr;
  MapHypothesis* hypothesis = nullptr;
  Random* random = nullptr;
  // Visual odometry goes on with more points than a pose near the last one would need, which therefore has to
  // satisfy the same conditions as any other pose after a loss.
  bool has_odometry = false;

  // For the place verification; the finder must be given.
  PlaceVerification::Query Query(RelocalizationResult* rejection) const {
    return {image, *finder, pose->comparison(), random, rejection};
  }
  RejectionReason RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& of) const {
    return criteria.RejectionReasonOf(result, of, pose->comparison());
  }
  // The map of the hypothesis; null if it is not available. The finder must be given.
  std::shared_ptr<const MapSnapshot> MapOfHypothesis() const;
};

// A pose that a search found.
struct FoundPose {
  enum class How {
    kNearby,    // near the last pose
    kReturned,  // in the same map, by place recognition
    kEntered,   // in another map or place, after enough frames confirmed it
  };
  How how = How::kNearby;
  std::shared_ptr<const MapSnapshot> map;
  std::uint64_t map_key = 0;
  MapTrackResult result;
};

// Returns to a place of the present map: tracks it once more with the main tracker, so that all results of
// the frame refer to this place. Where too little of what is in view fits, only a hypothesis begins: it may
// be a place of similar appearance. poor_visible_ratio: see TrackerOptions.
std::optional<FoundPose> ReturnToMap(const PoseSearch& search, const VerifiedPlace& found,
                                     double poor_visible_ratio, RelocalizationResult* rejection);
// Enters the map of a confirmed hypothesis, tracked by the main tracker for the same reason.
FoundPose EnterMap(const PoseSearch& search, std::shared_ptr<const MapSnapshot> map);

}  // namespace docent::engine
