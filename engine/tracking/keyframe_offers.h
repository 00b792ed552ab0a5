// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/mapping/keyframe_candidate.h"
#include "engine/tracking/camera_image.h"
#include "engine/tracking/keyframe_policy.h"
#include "engine/tracking/map_tracker.h"
#include "engine/tracking/tracker_options.h"

namespace docent::engine {

// Decides which frames of one camera are offered to the mapper as keyframes, and keeps account of those that
// it accepted. At most one offer per frame. Used on the camera's thread.
class KeyFrameOffers {
 public:
  KeyFrameOffers(const TrackerOptions& options, const CameraModel& camera);

  void SetCamera(const CameraModel& camera);
  // To be called when the map is left.
  void Reset();
  // To be called after a change of the map, and after a pose that does not continue the previous one.
  void Restart();
  // The previous frame's offer ends.
  void BeginFrame();

  // A tracked frame whose pose may be relied on.
  struct TrackedPose {
    const MapTrackResult& result;
    const std::vector<PointMatch>& matches;
    PanoramaId panorama = kNoId;  // whose points were searched
    double median_depth = 1;      // map units, of the finite points
  };
  // Offers the frame if it should become a keyframe. When the points were lost from one frame to the next, so
  // that only the whole image determines the rotation, the last frame that had a position is offered instead,
  // as the reference of a panorama map.
  void Consider(const CameraImage& image, const MapSnapshot& map, const TrackedPose& pose);
  // Offers the first image of a map that is empty so far.
  void OfferFirst(const CameraImage& image);
  // The mapper made a panorama map of the image that became this keyframe.
  void FirstIsMapped(const KeyFrame& first) {
    policy_.Accepted(KeyFrameChoice::kFirst, first.time, first.camera);
  }
  void Withdraw() { candidate_.reset(); }

  // The offer of this frame, once.
  std::optional<KeyFrameCandidate> Take();
  // To be called when the mapper accepted what Take returned; without it, the offer counts as refused.
  // Returns the keyframe's time; empty if nothing was taken from this frame.
  std::optional<Timestamp> Accept();

  const KeyFramePolicy& policy() const { return policy_; }

 private:
  struct Taken {
    KeyFrameChoice choice = KeyFrameChoice::kNone;
    Timestamp time{};
    int inliers = 0;
    std::shared_ptr<const CameraModel> camera;
    KeyFrameId first_new = 0;  // keyframes that the map had before have lower ids
  };
  // The last frame that had a position, with what an offer needs.
  struct Localized {
    CameraImage image;
    Rigid3 camera_from_map;
    std::vector<PointMatch> matches;
    std::uint64_t map_revision = 0;
    double median_depth = 1;
  };
  void Offer(KeyFrameChoice choice, const CameraImage& image, const MapSnapshot* map,
             const Rigid3& camera_from_map, const std::vector<PointMatch>& matches, PanoramaId panorama);
  bool IsTooEarly(const MapSnapshot& map, int inliers) const;
  void Remember(const CameraImage& image, const MapSnapshot& map, const TrackedPose& pose);
  void OfferLastLocalized(Timestamp now, const MapSnapshot& map);

  TrackerOptions options_;
  KeyFramePolicy policy_;
  std::optional<KeyFrameCandidate> candidate_;
  KeyFrameId first_new_ = 0;    // see Taken; of the candidate
  std::optional<Taken> taken_;  // what the mapper may still accept
  int frames_since_keyframe_ = 0;
  std::optional<Taken> accepted_;  // the last keyframe that the mapper accepted for this map
  bool awaits_accepted_ = false;   // it was accepted since the last Restart, so that this map is to get it
  Localized localized_;            // no image if there was none; its memory is used again
};

}  // namespace docent::engine
