// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/keyframe_words.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/vision/features.h"

namespace docent::engine {

namespace {

// Limits for one place, within which most of the image is shared: the distance as a ratio of the median
// depth, and the angle between the views.
constexpr double kMaxPlaceDistance = 0.5;
constexpr double kMaxPlaceAngle_rad = 35 * std::numbers::pi / 180;
// MakeFeatures needs an image at least this wide and high.
constexpr int kMinSidePx = 64;

}  // namespace

std::vector<KeyFrameId> PlacesOf(const MapSnapshot& map) {
  struct Place {
    KeyFrameId keyframe;
    Eigen::Vector3d center, view;
    double depth;
  };
  std::vector<Place> places;
  std::vector<KeyFrameId> place_of;
  place_of.reserve(map.keyframes.size());
  for (const KeyFrame& keyframe : map.keyframes) {
    const Place own{keyframe.id, keyframe.camera_from_map.OriginInSource(),
                    keyframe.camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ(),
                    keyframe.mean_depth};
    const auto near = std::find_if(places.begin(), places.end(), [&](const Place& place) {
      return (place.center - own.center).norm() <= kMaxPlaceDistance * std::min(place.depth, own.depth) &&
             place.view.dot(own.view) >= std::cos(kMaxPlaceAngle_rad);
    });
    place_of.push_back(near == places.end() ? own.keyframe : near->keyframe);
    if (near == places.end()) places.push_back(own);
  }
  return place_of;
}

WordBag WordsOf(const ImageFeatures& features) {
  const bool has_corners = !features.row_begin[0].empty();
  if (has_corners) return MakeWordBag(features);
  // The features may have been made without corners.
  features.MarkInUse();
  const cv::Mat& image = features.levels[0];
  if (image.cols < kMinSidePx || image.rows < kMinSidePx) return {};
  return MakeWordBag(*MakeFeatures(image));
}

std::vector<KeyFrameWords> MakeWords(const MapSnapshot& map, std::span<const KeyFrameWords> known) {
  const std::vector<KeyFrameId> places = PlacesOf(map);
  std::vector<KeyFrameWords> words;
  words.reserve(map.keyframes.size());
  for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
    const KeyFrame& keyframe = map.keyframes[i];
    const auto found =
        std::lower_bound(known.begin(), known.end(), keyframe.id,
                         [](const KeyFrameWords& k, KeyFrameId id) { return k.keyframe < id; });
    const bool is_known = found != known.end() && found->keyframe == keyframe.id;
    words.push_back({keyframe.id, places[i], is_known ? found->words : WordsOf(*keyframe.features)});
  }
  return words;
}

}  // namespace docent::engine
