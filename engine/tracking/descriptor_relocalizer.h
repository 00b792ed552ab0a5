// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/recognition/descriptor_database.h"
#include "engine/recognition/place.h"
#include "engine/recognition/word_bag.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// What an image looks like, described at the resolution of other images: a descriptor tolerates that a place
// appears a third larger or smaller, and pyramid levels are a factor of two apart. The image is therefore
// made smaller first when its pixels are finer than the others' by more than a quarter.
struct DescribedImage {
  std::vector<DescribedPlace> corners;  // pixels of the image itself
  WordBag words;
};
// pixel_angle: radians a pixel of the other images, see CameraModel::PixelAngle.
DescribedImage DescribeAtResolution(const ImageFeatures& features, const CameraModel& camera,
                                    double pixel_angle);

struct DescriptorRelocalizerOptions {
  // Keyframes that one call may describe; each takes three to five milliseconds. What is left is described in
  // the next calls.
  int keyframes_a_call = 2;
  std::size_t maps = 2;            // of the candidates, that a pose is looked for in by one call
  std::size_t max_maps = 4;        // that are remembered
  std::size_t max_keyframes = 48;  // of each, about 60 kB a keyframe
  int levels_around = 1;           // on which an observation is described beside its own
  double inlier_px = 5;            // RANSAC, level 0: corners of the upper levels are that coarse
  int min_inliers = 10;            // fewer are not worth the search for the map's points, which decides
  double min_inlier_ratio = 0.06;  // of the matches
  int max_iterations = 1000;       // finds the pose of a tenth of the matches with a probability of 63 %
};

// Suggests where a lost camera may be by the descriptors of its image's corners alone: they are matched with
// those of the map points that the candidate keyframes observe, of all candidates of one map together, and
// three-point RANSAC finds the pose that most matches agree with. In contrast to thumbnails this works from
// far beside the keyframes and for cameras with another field of view. Nothing is verified: who asks looks
// for the map's points from the suggested pose.
//
// The descriptors of keyframes are kept from call to call. Owned by one tracker and used by its thread alone;
// takes no lock and waits for nobody. The answer depends on the calls since Clear and on the seeds alone.
class DescriptorRelocalizer {
 public:
  explicit DescriptorRelocalizer(const DescriptorRelocalizerOptions& options = {},
                                 const VocabularyTree& tree = DefaultVocabulary());
  ~DescriptorRelocalizer();
  DescriptorRelocalizer(DescriptorRelocalizer&&) noexcept;

  struct Suggestion {
    PlaceCandidate candidate;  // the one that most of the matches are of
    Rigid3 camera_from_map;
    int inliers = 0;
  };
  // corners: of the camera's image. candidates: most alike first. At most one suggestion a map, most inliers
  // first.
  std::vector<Suggestion> Suggest(std::span<const DescribedPlace> corners, const CameraModel& camera,
                                  std::span<const PlaceCandidate> candidates, std::uint64_t seed);
  void Clear();

 private:
  struct DescribedMap;
  DescribedMap& Find(std::uint64_t map_key);
  // Describes a keyframe that is not described yet, unless no more may be described by this call.
  void Describe(const MapSnapshot& map, const KeyFrame& keyframe, DescribedMap* described, int* budget);
  std::optional<Suggestion> SuggestIn(const DescribedMap& described, std::span<const DescribedPlace> corners,
                                      const CameraModel& camera, const MapSnapshot& map,
                                      std::uint64_t seed) const;

  DescriptorRelocalizerOptions options_;
  const VocabularyTree* tree_;
  std::vector<std::unique_ptr<DescribedMap>> maps_;  // the last used first
};

}  // namespace docent::engine
