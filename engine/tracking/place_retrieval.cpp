// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/place_retrieval.h"

#include <algorithm>
#include <cmath>

#include "engine/base/stable_sort.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

std::optional<AlignedPlace> AlignPlace(const PlaceCandidate& candidate, const CameraImage& image) {
  const KeyFrame* keyframe = candidate.map ? candidate.map->FindKeyFrame(candidate.keyframe) : nullptr;
  if (!keyframe) return std::nullopt;
  const auto rotation = AlignRotation(keyframe->features->small_blurry, *keyframe->camera,
                                      image.features->small_blurry, *image.camera);
  if (!rotation) return std::nullopt;
  // Dividing by the overlap compensates that small overlaps agree more easily.
  return AlignedPlace{candidate,
                      Rigid3(rotation->b_from_a, Eigen::Vector3d::Zero()) * keyframe->camera_from_map,
                      rotation->rms / std::sqrt(rotation->overlap)};
}

std::vector<AlignedPlace> PlaceRetrieval::ByThumbnail(const CameraImage& image, const PlaceFinder& finder,
                                                      std::uint64_t excluded_map) const {
  std::vector<AlignedPlace> aligned;
  PlaceQuery query(image.features->small_blurry);
  query.places_first = false;  // among several keyframes of one place, the best alignment is the better guess
  const auto found = finder.FindPlaces(query, options_.max_retrieved, options_.max_retrieved_per_map, 0);
  if (excluded_map != 0 && (found.empty() || found.front().map_key == excluded_map)) return aligned;
  for (const PlaceCandidate& candidate : found) {
    if (candidate.map_key == excluded_map) continue;
    if (const auto place = AlignPlace(candidate, image)) aligned.push_back(*place);
  }
  StableSort(&aligned, [](const AlignedPlace& a, const AlignedPlace& b) {
    return a.alignment_error < b.alignment_error;
  });
  return aligned;
}

std::vector<AlignedPlace> PlaceRetrieval::ByWords(const CameraImage& image, const PlaceFinder& finder,
                                                  const std::vector<AlignedPlace>& tried) const {
  std::vector<AlignedPlace> aligned;
  const WordBag words = MakeWordBag(*image.features);
  if (words.empty()) return aligned;
  const auto found = finder.FindPlaces({image.features->small_blurry, words}, options_.max_retrieved,
                                       options_.max_retrieved_per_map, 0);
  for (const PlaceCandidate& candidate : found) {
    if (aligned.size() == options_.max_verified) break;
    const auto known = std::find_if(tried.begin(), tried.end(), [&](const AlignedPlace& place) {
      return place.candidate.map_key == candidate.map_key && place.candidate.keyframe == candidate.keyframe;
    });
    if (known != tried.end()) continue;
    if (const auto place = AlignPlace(candidate, image)) aligned.push_back(*place);
  }
  return aligned;
}

std::vector<AlignedPlace> PlaceRetrieval::ByDescriptors(const CameraImage& image, const PlaceFinder& finder,
                                                        std::uint64_t map_key, Random* random) {
  std::vector<AlignedPlace> suggested;
  // Most keyframes come from one camera: any of them gives the resolution of the descriptors.
  const auto any = finder.FindPlaces(image.features->small_blurry, 1, 1, map_key);
  const KeyFrame* keyframe =
      !any.empty() && any.front().map ? any.front().map->FindKeyFrame(any.front().keyframe) : nullptr;
  const DescribedImage described = DescribeAtResolution(
      *image.features, *image.camera, keyframe ? keyframe->camera->PixelAngle() : image.camera->PixelAngle());
  if (described.words.empty()) return suggested;
  PlaceQuery query(image.features->small_blurry, described.words);
  query.places_first = false;
  const auto found = finder.FindPlaces(query, options_.max_retrieved, options_.max_retrieved, 0);
  for (const auto& suggestion :
       descriptor_relocalizer_.Suggest(described.corners, *image.camera, found, random->Next()))
    suggested.push_back({suggestion.candidate, suggestion.camera_from_map, 0});
  return suggested;
}

}  // namespace docent::engine
