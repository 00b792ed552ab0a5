// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/tracking/pose_search.h"

namespace docent::engine {

// Finds the pose of a lost camera (ptamm §3.2, §5.3, §6.3): for a short time near the last pose, then
// wherever place recognition suggests, in its own map or, after enough frames agree, in another one. Used on
// the camera's thread.
class Relocalizer {
 public:
  explicit Relocalizer(const TrackerOptions& options) : options_(options) {}

  // The camera was in no map before.
  void Reset() { leader_ = {}; }
  // The camera is lost since this frame.
  void Lose(Timestamp time);
  // The camera is lost, but this is where it is.
  void StayNear(Timestamp time) { lost_since_ = time; }
  // The camera is to be found in a map that it was not tracked in.
  void LoseLongAgo();
  // The camera was relocalized.
  void Succeed() { leader_.frames = 0; }

  // Searches the pose in this frame. *out receives state, hint and rejection reason.
  std::optional<FoundPose> Search(const PoseSearch& search, TrackedFrame* out);

  Timestamp lost_since() const { return lost_since_; }

 private:
  enum class Attempt { kFound, kGoOn, kEnded };  // kEnded: nothing more is tried in this frame
  Attempt SearchNearby(const PoseSearch& search, TrackedFrame* out, std::optional<FoundPose>* found);
  // Continues a hypothesis by tracking it from its previous pose, which makes consecutive poses agree. It
  // becomes *missed if that gives no pose, but the image does not contradict it either.
  Attempt ContinueHypothesis(const PoseSearch& search, MapHypothesis* missed, TrackedFrame* out,
                             std::optional<FoundPose>* found);
  // missed: the hypothesis whose prediction gave no pose in this frame, if there is one.
  std::optional<FoundPose> SearchPlaces(const PoseSearch& search, const MapHypothesis& missed,
                                        TrackedFrame* out);
  bool HasBetterCompetitor(const PoseSearch& search, const MapTrackResult& result, TrackedFrame* out) const;
  // Whether the best-to-second ratio is large enough in this frame, or the best map led in enough consecutive
  // frames. The key of the map that the camera was in is `own`.
  bool IsUnambiguous(std::uint64_t best_key, double best_quality, std::uint64_t second_key,
                     double second_quality, std::uint64_t own);

  TrackerOptions options_;
  Timestamp lost_since_{};
  int frames_lost_ = 0;  // searched frames since the loss
  // The better of two maps that both explain the images, and for how many frames.
  struct Leader {
    std::uint64_t key = 0;
    int frames = 0;
  } leader_;
};

}  // namespace docent::engine
