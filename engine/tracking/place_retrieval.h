// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/base/random.h"
#include "engine/recognition/place.h"
#include "engine/tracking/camera_image.h"
#include "engine/tracking/descriptor_relocalizer.h"
#include "engine/tracking/tracker_options.h"

namespace docent::engine {

// A retrieved keyframe and the camera pose that its alignment with the image suggests.
struct AlignedPlace {
  PlaceCandidate candidate;
  Rigid3 camera_from_map;
  double alignment_error = 0;  // of the thumbnails after alignment, grey values
};

// Empty if the keyframe no longer exists, or the thumbnails cannot be aligned by a rotation.
std::optional<AlignedPlace> AlignPlace(const PlaceCandidate& candidate, const CameraImage& image);

// Retrieves the places that an image may show, by thumbnail, visual words or descriptors (ptamm §3.2). Not
// verified: see PlaceVerification. Used on the camera's thread.
class PlaceRetrieval {
 public:
  explicit PlaceRetrieval(const TrackerOptions& options) : options_(options) {}

  // Best alignment first. excluded_map: no place of that map; the result is empty if the most similar
  // keyframe is of that map.
  std::vector<AlignedPlace> ByThumbnail(const CameraImage& image, const PlaceFinder& finder,
                                        std::uint64_t excluded_map = 0) const;
  // The first distinct places by thumbnail and visual words, without the keyframes of `tried`.
  std::vector<AlignedPlace> ByWords(const CameraImage& image, const PlaceFinder& finder,
                                    const std::vector<AlignedPlace>& tried) const;
  // By descriptor matching, in maps that the visual words suggest. map_key: the map that the camera was in.
  std::vector<AlignedPlace> ByDescriptors(const CameraImage& image, const PlaceFinder& finder,
                                          std::uint64_t map_key, Random* random);

 private:
  TrackerOptions options_;
  DescriptorRelocalizer descriptor_relocalizer_;
};

}  // namespace docent::engine
