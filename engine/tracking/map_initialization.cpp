// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/map_initialization.h"

#include <algorithm>
#include <cmath>

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

// The parallax does not grow between an image and those of a camera that has come back. What confirms the
// depths is that it turns on meanwhile, and sees them through another part of the lens and of the readout. Of
// 360 wide pairs with significant depth in recorded and rendered sequences, whose shutter was taken for a
// global one, none had a direction that was wrong by more than 20 degrees.
InitializerOptions ForWideBaselines(InitializerOptions options) {
  options.confirmation.min_growth = 0;
  options.confirmation.with_any_readout = false;
  return options;
}

}  // namespace

MapInitialization::MapInitialization(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera,
                                     std::uint64_t initializer_seed, std::uint64_t target_seed)
    : options_(options),
      initializer_(options.initializer, camera, initializer_seed),
      wide_initializer_(ForWideBaselines(options.initializer), camera, initializer_seed + 1) {
  if (options.target)
    target_initializer_.emplace(options.target, options.target_start, std::move(camera), target_seed);
}

void MapInitialization::SetCamera(std::shared_ptr<const CameraModel> camera, Random* random) {
  initializer_.SetCamera(camera);
  wide_initializer_.SetCamera(camera);
  if (options_.target)
    target_initializer_.emplace(options_.target, options_.target_start, std::move(camera), random->Next());
}

void MapInitialization::ResetViews() {
  initializer_.Reset();
  if (target_initializer_) target_initializer_->Reset();
  first_views_from_map_.clear();
}

Timestamp MapInitialization::OldestFirstView() const {
  if (target_initializer_) return target_initializer_->first_time();
  const auto& views = initializer_.tracks().views();
  return views.empty() ? Timestamp::min() : views.front().time;
}

Timestamp MapInitialization::NewestFirstView() const {
  if (target_initializer_) return target_initializer_->first_time();
  const auto& views = initializer_.tracks().views();
  return views.empty() ? Timestamp::min() : views.back().time;
}

Rigid3 MapInitialization::FirstViewFromMap(Timestamp time) const {
  const auto view = std::ranges::find(first_views_from_map_, time, &std::pair<Timestamp, Rigid3>::first);
  return view != first_views_from_map_.end() ? view->second : Rigid3();
}

void MapInitialization::RememberFirstView(Timestamp time, const Rigid3& camera_from_map) {
  std::erase_if(first_views_from_map_, [&](const auto& view) { return view.first < OldestFirstView(); });
  first_views_from_map_.emplace_back(time, camera_from_map);
}

void MapInitialization::Begin() {
  Stop();
  phase_ = Phase::kSearching;
}

void MapInitialization::Stop() {
  phase_ = Phase::kOff;
  pair_.reset();
  keyframe_rotation_rates_.clear();
  wide_initializer_.Reset();
  wide_views_.Reset();
  ResetViews();
}

void MapInitialization::PairFailed() {
  if (phase_ == Phase::kPairGiven) phase_ = Phase::kSearching;
}

void MapInitialization::FirstIsMapped(Timestamp time, const Rigid3& camera_from_map) {
  // The keypoint tracks of the initializer must start in a frame with a known pose.
  if (OldestFirstView() != time) {
    ResetViews();
    return;
  }
  first_views_from_map_.assign(1, {time, camera_from_map});
}

void MapInitialization::AddKeyFrame(Timestamp time, const Eigen::Vector3d& rotation_rate) {
  if (is_on()) keyframe_rotation_rates_.emplace_back(time, rotation_rate);
}

std::optional<InitialPair> MapInitialization::TrackViews(const CameraImage& image, Hint* hint) {
  std::optional<InitialPair> pair;
  if (target_initializer_) {
    if (auto start = target_initializer_->Track(image.time, image.features)) pair = std::move(start->pair);
    *hint = target_initializer_->hint();
  } else {
    pair = initializer_.Track(image.time, image.features);
    *hint = initializer_.hint();
  }
  return pair;
}

void MapInitialization::Search(const CameraImage& image, const MapSnapshot* map, PanoramaId panorama,
                               const Eigen::Vector3d& rotation_rate, TrackedFrame* out) {
  if (!map) out->state = TrackingState::kInitializing;
  if (phase_ == Phase::kPairGiven) {
    if (!target_initializer_) out->initialization_progress = 1;
    if (!map) out->hint = Hint::kWaitForMap;
    return;
  }
  const bool posed = HasPose(out->state);
  if (map && !posed) {
    // Without a pose the initializer's first view would have no position in the map.
    ResetViews();
    return;
  }
  const bool directions = options_.hybrid && options_.build_maps;
  if (!map && directions) ResetViews();  // the map's first image is also the initializer's first view
  pair_ = TrackViews(image, &out->hint);
  if (pair_) pair_->a_from_map = FirstViewFromMap(pair_->a.time);
  if (!pair_ && map && posed && directions && !target_initializer_)
    pair_ = TryPanoramaViews(image, *map, panorama, rotation_rate, *out);
  if (!pair_ && map && posed && directions && !target_initializer_)
    pair_ = TryWideBaseline(image, rotation_rate, *out);
  if (pair_) phase_ = Phase::kPairGiven;
  if (pair_ && !target_initializer_) initializer_.EndWith(*pair_);
  if (!target_initializer_) out->initialization_progress = pair_ ? 1 : initializer_.progress();
  if (NewestFirstView() == image.time) RememberFirstView(image.time, posed ? out->camera_from_map : Rigid3());
}

// The panorama keyframe with the largest parallax to the image: the largest median distance of its points
// from the pixels that the rotation alone predicts. Null if no keyframe has enough parallax for the
// initializer.
const KeyFrame* MapInitialization::FindMaxParallaxKeyFrame(const CameraImage& image, const MapSnapshot& map,
                                                           PanoramaId panorama, const TrackedFrame& tracked) {
  // With less, no initialization is significant at a keypoint noise of 0.3 pixels.
  constexpr double kMinParallaxPx = 4;
  constexpr std::size_t kMinShared = 60;
  sorted_matches_ = tracked.matches;
  std::sort(sorted_matches_.begin(), sorted_matches_.end(),
            [](const PointMatch& a, const PointMatch& b) { return a.point < b.point; });
  const KeyFrame* widest = nullptr;
  double widest_px = kMinParallaxPx;
  std::vector<double> parallax_px;
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.panorama == kNoId || keyframe.panorama != panorama) continue;
    const Rotation3 now_from_keyframe =
        tracked.camera_from_map.rotation * keyframe.camera_from_map.rotation.inverse();
    parallax_px.clear();
    ForShared(map, keyframe.id, sorted_matches_, [&](const Observation& seen, const PointMatch& match) {
      const auto before = keyframe.camera->Unproject(seen.pixel.cast<double>());
      if (!before) return;
      const auto expected = image.camera->Project(now_from_keyframe * *before);
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

std::optional<InitialPair> MapInitialization::TryPanoramaViews(const CameraImage& image,
                                                               const MapSnapshot& map, PanoramaId panorama,
                                                               const Eigen::Vector3d& rotation_rate,
                                                               const TrackedFrame& tracked) {
  constexpr int kInterval = 3;  // frames; the initializer itself makes such an attempt every second frame
  if (++frames_since_views_ < kInterval || tracked.matches.empty()) return std::nullopt;
  frames_since_views_ = 0;
  const KeyFrame* const keyframe = FindMaxParallaxKeyFrame(image, map, panorama, tracked);
  if (!keyframe) return std::nullopt;
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  ForShared(map, keyframe->id, sorted_matches_, [&](const Observation& seen, const PointMatch& match) {
    matches.push_back({seen.pixel, match.pixel, seen.level});
    ids.push_back(seen.point);
  });
  const auto rate = std::find_if(keyframe_rotation_rates_.begin(), keyframe_rotation_rates_.end(),
                                 [&](const auto& entry) { return entry.first == keyframe->time; });
  const Eigen::Vector3d before =
      rate != keyframe_rotation_rates_.end() ? rate->second : Eigen::Vector3d(Eigen::Vector3d::Zero());
  auto pair = initializer_.TryViews({keyframe->time, keyframe->features, keyframe->camera},
                                    {image.time, image.features, image.camera}, std::move(matches), ids,
                                    (rotation_rate - before).norm() / image.camera->PixelAngle(),
                                    [this] { return initializer_.ReadoutFromCorners(); });
  if (pair) pair->a_from_map = keyframe->camera_from_map;
  return pair;
}

std::optional<InitialPair> MapInitialization::TryWideBaseline(const CameraImage& image,
                                                              const Eigen::Vector3d& rotation_rate,
                                                              const TrackedFrame& tracked) {
  constexpr int kInterval = 4;  // frames: at 30 Hz, an attempt takes a tenth of the time until the next
  if (++frames_since_wide_views_ < kInterval) return std::nullopt;
  frames_since_wide_views_ = 0;
  for (auto& views : wide_views_.Pairs(image, tracked.camera_from_map, rotation_rate)) {
    const double speed_change_px =
        (rotation_rate - views.earlier.rotation_rate).norm() / image.camera->PixelAngle();
    auto pair = wide_initializer_.TryViews(views.earlier.image, {image.time, image.features, image.camera},
                                           std::move(views.matches), views.ids, speed_change_px,
                                           [this] { return initializer_.ReadoutFromCorners(); });
    if (pair) {
      pair->a_from_map = views.earlier.camera_from_map;
      return pair;
    }
    if (wide_initializer_.awaits_confirmation()) wide_views_.TryAgain(views.earlier);
  }
  return std::nullopt;
}

}  // namespace docent::engine
