// SPDX-License-Identifier: Apache-2.0
// Finds the two views from which a panorama map gets finite points.
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/tracking/tracker.h"

namespace docent::engine {

namespace {

// Calls `each` for every point that both a keyframe and the present frame observe. Both ranges ascend by
// point.
template <class Each>
void ForShared(const MapSnapshot& map, KeyFrameId keyframe, const std::vector<PointMatch>& matches,
               const Each& each) {
  auto seen = std::lower_bound(
      map.observations.begin(), map.observations.end(), keyframe,
      [](const Observation& observation, KeyFrameId wanted) { return observation.keyframe < wanted; });
  auto match = matches.begin();
  while (seen != map.observations.end() && seen->keyframe == keyframe && match != matches.end()) {
    if (seen->point < match->point) {
      ++seen;
    } else if (match->point < seen->point) {
      ++match;
    } else {
      each(*seen++, *match++);
    }
  }
}

}  // namespace

// The panorama keyframe with the largest parallax to the image: the largest median distance of its points
// from the pixels that the rotation alone predicts. Null if no keyframe has enough parallax for the
// initializer.
const KeyFrame* Tracker::FindMaxParallaxKeyFrame(const TrackedFrame& out) {
  // With less, no initialization is significant at a keypoint noise of 0.3 pixels.
  constexpr double kMinParallaxPx = 4;
  constexpr std::size_t kMinShared = 60;
  sorted_matches_ = out.matches;
  std::sort(sorted_matches_.begin(), sorted_matches_.end(),
            [](const PointMatch& a, const PointMatch& b) { return a.point < b.point; });
  const KeyFrame* widest = nullptr;
  double widest_px = kMinParallaxPx;
  std::vector<double> parallax_px;
  for (const KeyFrame& keyframe : map_->keyframes) {
    if (keyframe.panorama == kNoId || keyframe.panorama != map_tracker_.panorama()) continue;
    const Rotation3 now_from_keyframe =
        out.camera_from_map.rotation * keyframe.camera_from_map.rotation.inverse();
    parallax_px.clear();
    ForShared(*map_, keyframe.id, sorted_matches_, [&](const Observation& seen, const PointMatch& match) {
      const auto before = keyframe.camera->Unproject(seen.pixel.cast<double>());
      if (!before) return;
      const auto expected = camera_->Project(now_from_keyframe * *before);
      if (expected) parallax_px.push_back((*expected - match.pixel.cast<double>()).norm());
    });
    if (parallax_px.size() < kMinShared) continue;
    const auto middle = parallax_px.begin() + static_cast<std::ptrdiff_t>(parallax_px.size() / 2);
    std::nth_element(parallax_px.begin(), middle, parallax_px.end());
    if (*middle <= widest_px) continue;
    widest_px = *middle;
    widest = &keyframe;
  }
  return widest;
}

std::optional<InitialPair> Tracker::TryPanoramaViews(const Frame& frame, const TrackedFrame& out) {
  constexpr int kInterval = 3;  // frames; the initializer itself makes such an attempt every second frame
  if (++frames_since_views_ < kInterval || !map_ || out.matches.empty()) return std::nullopt;
  frames_since_views_ = 0;
  const KeyFrame* const keyframe = FindMaxParallaxKeyFrame(out);
  if (!keyframe) return std::nullopt;
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  ForShared(*map_, keyframe->id, sorted_matches_, [&](const Observation& seen, const PointMatch& match) {
    matches.push_back({seen.pixel, match.pixel, seen.level});
    ids.push_back(seen.point);
  });
  const auto rate = std::find_if(keyframe_rotation_rates_.begin(), keyframe_rotation_rates_.end(),
                                 [&](const auto& entry) { return entry.first == keyframe->time; });
  const Eigen::Vector3d before =
      rate != keyframe_rotation_rates_.end() ? rate->second : Eigen::Vector3d(Eigen::Vector3d::Zero());
  auto pair =
      initializer_.TryViews({keyframe->time, keyframe->features}, {frame.time, features_}, std::move(matches),
                            ids, (rotation_rate_ - before).norm() / camera_->PixelAngle());
  if (pair) pair->a_from_map = keyframe->camera_from_map;
  return pair;
}

}  // namespace docent::engine
