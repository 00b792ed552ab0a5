// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/descriptor_relocalizer.h"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/base/stable_sort.h"
#include "engine/recognition/absolute_pose.h"
#include "engine/vision/descriptor.h"
#include "engine/vision/features.h"

namespace docent::engine {

std::optional<std::string> DescriptorRelocalizerOptions::Validate() const {
  return OptionCheck()
      .AtLeast(max_keyframes_per_call, 1, "number of keyframes described per call")
      .That(max_maps_per_call > 0, "A pose must be estimated in at least one map per call.")
      .That(max_cached_maps > 0, "The descriptors of at least one map must be cached.")
      .That(max_cached_keyframes > 0, "The descriptors of at least one keyframe must be cached.")
      .Within(levels_around, 0, kPyramidLevels, "number of pyramid levels around an observation")
      .Positive(inlier_px, "distance of an inlier")
      .AtLeast(min_inliers, 3, "number of inliers of a suggestion")
      .Ratio(min_inlier_ratio, "inlier ratio of a suggestion")
      .AtLeast(max_iterations, 1, "number of iterations")
      .fault();
}

DescribedImage DescribeAtResolution(const ImageFeatures& features, const CameraModel& camera,
                                    double pixel_angle) {
  // Limit of the resampling and smallest image side for feature extraction.
  constexpr double kFinest = 0.8, kMinSide = 64;
  const double ratio = camera.PixelAngle() / pixel_angle;
  const cv::Mat& image = features.levels[0];
  const int width = static_cast<int>(image.cols * ratio), height = static_cast<int>(image.rows * ratio);
  if (ratio >= kFinest || std::min(width, height) < kMinSide)
    return {DescribeCorners(features), MakeWordBag(features)};
  cv::Mat smaller;
  cv::resize(image, smaller, cv::Size(width, height), 0, 0, cv::INTER_AREA);
  const auto described = MakeFeatures(smaller);
  DescribedImage result{DescribeCorners(*described), MakeWordBag(*described)};
  const Eigen::Array2f larger(static_cast<float>(image.cols) / static_cast<float>(width),
                              static_cast<float>(image.rows) / static_cast<float>(height));
  for (DescribedKeypoint& corner : result.corners)
    corner.pixel = (corner.pixel.array() + 0.5f) * larger - 0.5f;
  return result;
}

struct DescriptorRelocalizer::DescribedMap {
  struct DescribedKeyFrame {
    KeyFrameId id = kNoId;
    std::weak_ptr<const ImageFeatures> features;  // the features that were described
  };
  DescribedMap(std::uint64_t key, const VocabularyTree& tree) : map_key(key), database(tree) {}

  std::uint64_t map_key;
  DescriptorDatabase database;
  std::vector<DescribedKeyFrame> keyframes;  // most recently used last
};

DescriptorRelocalizer::DescriptorRelocalizer(const DescriptorRelocalizerOptions& options,
                                             const VocabularyTree& tree)
    : options_(Checked(options)), tree_(&tree) {}
DescriptorRelocalizer::~DescriptorRelocalizer() = default;
DescriptorRelocalizer::DescriptorRelocalizer(DescriptorRelocalizer&&) noexcept = default;

DescriptorRelocalizer::DescribedMap& DescriptorRelocalizer::Find(std::uint64_t map_key) {
  const auto found = std::find_if(maps_.begin(), maps_.end(),
                                  [&](const auto& described) { return described->map_key == map_key; });
  if (found != maps_.end()) {
    std::rotate(maps_.begin(), found, found + 1);
  } else {
    if (maps_.size() >= options_.max_cached_maps) maps_.pop_back();
    maps_.insert(maps_.begin(), std::make_unique<DescribedMap>(map_key, *tree_));
  }
  return *maps_.front();
}

void DescriptorRelocalizer::Describe(const MapSnapshot& map, const KeyFrame& keyframe,
                                     DescribedMap* described, int* budget) {
  auto& known = described->keyframes;
  const auto found =
      std::find_if(known.begin(), known.end(), [&](const auto& other) { return other.id == keyframe.id; });
  if (found != known.end()) {
    if (found->features.lock() == keyframe.features) {
      std::rotate(found, found + 1, known.end());
      return;
    }
    described->database.RemoveKeyFrame(keyframe.id);
    known.erase(found);
  }
  if (*budget <= 0) return;
  --*budget;
  if (known.size() >= options_.max_cached_keyframes) {
    described->database.RemoveKeyFrame(known.front().id);
    known.erase(known.begin());
  }
  const auto first = std::lower_bound(
      map.observations.begin(), map.observations.end(), keyframe.id,
      [](const Observation& observation, KeyFrameId id) { return observation.keyframe < id; });
  for (auto it = first; it != map.observations.end() && it->keyframe == keyframe.id; ++it) {
    const MapPoint* point = map.FindPoint(it->point);
    if (point && !point->infinite())
      AddObservation(*keyframe.features, *it, options_.levels_around, &described->database);
  }
  known.push_back({keyframe.id, keyframe.features});
}

std::optional<DescriptorRelocalizer::Suggestion> DescriptorRelocalizer::SuggestIn(
    const DescribedMap& described, std::span<const DescribedKeypoint> corners, const CameraModel& camera,
    const MapSnapshot& map, std::uint64_t seed) const {
  std::vector<Descriptor> queries;
  queries.reserve(corners.size());
  for (const DescribedKeypoint& corner : corners) queries.push_back(corner.oriented.descriptor);
  std::vector<Eigen::Vector3d> rays, points;
  std::vector<KeyFrameId> keyframes;  // of each match
  for (const DescriptorDatabase::Match& match : described.database.FindMatches(queries, {})) {
    const MapPoint* point = map.FindPoint(match.entry.point);
    const auto ray = camera.Unproject(corners[match.query].pixel.cast<double>());
    if (!point || point->infinite() || !ray) continue;
    rays.push_back(*ray);
    points.push_back(point->position());
    keyframes.push_back(match.entry.keyframe);
  }
  AbsolutePoseOptions pose_options;
  pose_options.pixel_angle = camera.PixelAngle();
  pose_options.inlier_px = options_.inlier_px;
  pose_options.min_inliers = options_.min_inliers;
  pose_options.min_inlier_ratio = options_.min_inlier_ratio;
  pose_options.max_iterations = options_.max_iterations;
  pose_options.seed = seed;
  const auto pose = EstimateAbsolutePose(rays, points, pose_options);
  if (!pose) return std::nullopt;
  std::map<KeyFrameId, int> votes;
  for (std::size_t i = 0; i < keyframes.size(); ++i)
    if (pose->inlier[i] && map.FindKeyFrame(keyframes[i])) ++votes[keyframes[i]];
  if (votes.empty()) return std::nullopt;
  const auto most = std::max_element(votes.begin(), votes.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  Suggestion suggestion;
  suggestion.candidate.map_key = described.map_key;
  suggestion.candidate.keyframe = most->first;
  suggestion.camera_from_map = pose->camera_from_map;
  suggestion.inliers = pose->inlier_count;
  return suggestion;
}

std::vector<DescriptorRelocalizer::Suggestion> DescriptorRelocalizer::Suggest(
    std::span<const DescribedKeypoint> corners, const CameraModel& camera,
    std::span<const PlaceCandidate> candidates, std::uint64_t seed) {
  std::vector<Suggestion> suggestions;
  std::vector<std::uint64_t> keys;
  int budget = options_.max_keyframes_per_call;
  for (const PlaceCandidate& candidate : candidates) {
    if (!candidate.map || std::find(keys.begin(), keys.end(), candidate.map_key) != keys.end()) continue;
    if (keys.size() == options_.max_maps_per_call) break;
    keys.push_back(candidate.map_key);
    DescribedMap& described = Find(candidate.map_key);
    for (const PlaceCandidate& other : candidates) {
      const KeyFrame* keyframe =
          other.map_key == candidate.map_key ? candidate.map->FindKeyFrame(other.keyframe) : nullptr;
      if (keyframe) Describe(*candidate.map, *keyframe, &described, &budget);
    }
    if (auto suggestion = SuggestIn(described, corners, camera, *candidate.map, seed)) {
      suggestion->candidate.map = candidate.map;
      suggestions.push_back(std::move(*suggestion));
    }
  }
  StableSort(&suggestions, [](const Suggestion& a, const Suggestion& b) { return a.inliers > b.inliers; });
  return suggestions;
}

}  // namespace docent::engine
