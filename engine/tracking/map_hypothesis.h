// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "engine/tracking/camera_image.h"
#include "engine/tracking/place_verification.h"

namespace docent::engine {

// A map, or another place in the present one, that explains the image, until enough consecutive frames have
// confirmed it or one contradicts it (ptamm §6.3). At most one per camera, whether the camera is lost or
// tracked. Plain value.
class MapHypothesis {
 public:
  void Begin(std::uint64_t map_key, const Rigid3& camera_from_map, PanoramaId panorama);
  void Begin(const VerifiedPlace& found);
  // The present frame gave this pose.
  void Confirm(const Rigid3& camera_from_map);
  // The place was found again in the present frame, by place recognition, and not from the pose of
  // `previous`. The frames that agreed with that agree with this one too, but at most `max_frames` count.
  void Resume(const MapHypothesis& previous, int max_frames);
  void Clear() { frames_ = 0; }

  bool exists() const { return frames_ > 0; }
  int frames() const { return frames_; }  // consecutive frames that agree so far
  std::uint64_t map_key() const { return map_key_; }
  PanoramaId panorama() const { return panorama_; }
  const Rigid3& camera_from_map() const { return camera_from_map_; }
  // The pose in the present image: the last one, rotated as the images are.
  Rigid3 Predict(const CameraImage& image) const;
  // Whether a pose that was found in the present image is of the place of this hypothesis, so that the next
  // frames confirm or contradict both.
  bool IsOfPlace(const CameraImage& image, std::uint64_t map_key, const MapTrackResult& result) const;
  // Of a frame that the hypothesis explains, before it is confirmed.
  RelocalizationResult Unconfirmed(const MapTrackResult& result) const;

 private:
  std::uint64_t map_key_ = 0;
  int frames_ = 0;
  Rigid3 camera_from_map_;
  PanoramaId panorama_ = kNoId;
};

}  // namespace docent::engine
