// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/map/map_snapshot.h"
#include "engine/tracking/map_tracker.h"
#include "engine/tracking/relocalization_result.h"
#include "engine/tracking/tracker_options.h"

namespace docent::engine {

// Decides whether an estimated pose is right, by its inliers, their residuals and their spread over the
// image. Without state: the same result is judged the same way at any time.
class PoseCriteria {
 public:
  explicit PoseCriteria(const TrackerOptions& options) : options_(options) {}

  // Of a frame that continues the track. comparison: how the patches were compared.
  bool IsAccepted(const MapTrackResult& result, PatchComparison comparison) const;
  // Keeps the track with few points that fit closely, for cameras whose images show little of the map because
  // of their field of view or photometric differences. Only while maps are not extended, and only continuing
  // a recent pose: no place is recognized by such a pose.
  bool KeepsTrackWithFewPoints(const MapTrackResult& result) const;
  // Good tracking quality: the map may be extended.
  bool IsGood(const MapTrackResult& result) const;
  // Whether a pose that is a pure rotation fits the measurements; true for all other poses.
  bool FitsRotation(const MapTrackResult& result, const MapSnapshot& map) const;
  // Most of the image shows something else than the map.
  bool IsContradicted(const MapTrackResult& result) const;
  // Why a pose that was found after a loss is rejected; kNone if it is accepted.
  RejectionReason RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& map,
                                    PatchComparison comparison) const;

 private:
  bool HasConsensus(const MapTrackResult& result) const;

  TrackerOptions options_;
};

}  // namespace docent::engine
