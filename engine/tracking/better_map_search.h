// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "engine/tracking/pose_search.h"
#include "engine/tracking/relocalization_confirmation.h"

namespace docent::engine {

// Looks for another map, or another place in the same one, that explains the image better than the pose of a
// tracked camera (ptamm §5.3). Each search costs as much as ten frames, so that they are rationed. Used on
// the camera's thread.
class BetterMapSearch {
 public:
  explicit BetterMapSearch(const TrackerOptions& options) : options_(options) {}

  // The camera was relocalized.
  void Restart() { frames_since_relocalization_ = 0; }

  // To be called once per tracked frame, each where it applies. out: the frame as it was tracked;
  // visible_inlier_ratio: of its pose.
  //
  // A relocalization with a low visible inlier ratio may be at another place of similar appearance: until the
  // ratio is high enough, other places of the map are tried. pending: the relocalization is unconfirmed.
  std::optional<FoundPose> SearchOtherPlace(const PoseSearch& search, bool pending,
                                            double visible_inlier_ratio, TrackedFrame* out);
  // Where maps overlap, the points that both contain keep the camera in its present map although the other
  // one may show more from here. The other map is entered when its visible inlier ratio is clearly higher.
  // For maps that are not extended.
  std::optional<FoundPose> SearchOverlappingMap(const PoseSearch& search, double visible_inlier_ratio,
                                                const TrackedFrame& out);
  // For a map that was started because the camera was lost: if a known map explains the image, the camera
  // returns to it as if it were still lost, so that no place is mapped twice.
  std::optional<FoundPose> SearchKnownMaps(const PoseSearch& search);

 private:
  // Tracks the hypothesis in the present frame: its map and the pose, or null if it is not confirmed.
  std::shared_ptr<const MapSnapshot> Continue(const PoseSearch& search, MapTrackResult* result) const;

  TrackerOptions options_;
  int frames_since_search_ = 0;
  unsigned frames_since_relocalization_ = 0;  // while the relocalization is unconfirmed
};

}  // namespace docent::engine
