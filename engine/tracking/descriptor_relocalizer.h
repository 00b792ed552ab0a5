// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/recognition/descriptor_database.h"
#include "engine/recognition/place.h"
#include "engine/recognition/word_bag.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// The keypoint descriptors and visual words of an image, computed at the angular resolution of the keyframes
// that they are compared with. A descriptor tolerates a scale change of about a third, but pyramid levels are
// a factor of two apart. DescribeAtResolution therefore shrinks the image first when its pixels are finer
// than theirs by more than a quarter.
struct DescribedImage {
  std::vector<DescribedKeypoint> corners;  // pixels of the original image
  WordBag words;
};
// pixel_angle: angular pixel size of the keyframes' images, in radians per pixel (CameraModel::PixelAngle).
DescribedImage DescribeAtResolution(const ImageFeatures& features, const CameraModel& camera,
                                    double pixel_angle);

struct DescriptorRelocalizerOptions {
  // Number of keyframes that one call of Suggest may describe; each takes 3 to 5 ms. The others are described
  // in later calls.
  int max_keyframes_per_call = 2;
  std::size_t max_maps_per_call =
      2;  // A pose is estimated in at most this many of the candidates' maps per call.
  std::size_t max_cached_maps = 4;        // Maps whose descriptors are cached.
  std::size_t max_cached_keyframes = 48;  // Keyframes cached per map; each takes about 60 kB.
  int levels_around = 1;  // Pyramid levels above and below its own on which an observation is described too.
  // RANSAC threshold in level-0 pixels; keypoints of the upper levels are no more accurate.
  double inlier_px = 5;
  int min_inliers = 10;  // A pose with fewer inliers is not worth the search for map points that verifies it.
  double min_inlier_ratio = 0.06;  // of the matches
  int max_iterations = 1000;       // finds a pose with 10 % inliers with a probability of 63 %

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Suggests poses for a lost camera from the descriptors of its keypoints alone. It matches them with the
// descriptors of the map points that the candidate keyframes observe, taking all candidates of one map
// together, and estimates the pose by three-point RANSAC. In contrast to thumbnails this works far from the
// keyframes and for cameras with another field of view. The poses are not verified: the caller searches the
// map's points from each suggested pose.
//
// Descriptors of keyframes are cached from call to call. One tracker owns the object and uses it on its
// thread alone; it takes no lock and never waits. The result depends only on the seeds and on the calls
// before.
class DescriptorRelocalizer {
 public:
  explicit DescriptorRelocalizer(const DescriptorRelocalizerOptions& options = {},
                                 const VocabularyTree& tree = DefaultVocabulary());
  ~DescriptorRelocalizer();
  DescriptorRelocalizer(DescriptorRelocalizer&&) noexcept;

  struct Suggestion {
    PlaceCandidate candidate;  // the keyframe that most of the inlier matches belong to
    Rigid3 camera_from_map;
    int inliers = 0;
  };
  // corners: keypoints of the camera's image. candidates: most similar keyframe first. Returns at most one
  // suggestion per map, in descending order of inliers.
  std::vector<Suggestion> Suggest(std::span<const DescribedKeypoint> corners, const CameraModel& camera,
                                  std::span<const PlaceCandidate> candidates, std::uint64_t seed);

 private:
  struct DescribedMap;
  DescribedMap& Find(std::uint64_t map_key);
  // Adds a keyframe to the database unless it is there already. Each addition takes one from *budget.
  void Describe(const MapSnapshot& map, const KeyFrame& keyframe, DescribedMap* described, int* budget);
  std::optional<Suggestion> SuggestIn(const DescribedMap& described,
                                      std::span<const DescribedKeypoint> corners, const CameraModel& camera,
                                      const MapSnapshot& map, std::uint64_t seed) const;

  DescriptorRelocalizerOptions options_;
  const VocabularyTree* tree_;
  std::vector<std::unique_ptr<DescribedMap>> maps_;  // most recently used first
};

}  // namespace docent::engine
