// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/nearby_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

// The first item for which is_before is false; fast if it is close to begin.
template <typename Item, typename IsBefore>
const Item* FirstNot(const Item* begin, const Item* end, const IsBefore& is_before) {
  std::ptrdiff_t step = 1;
  while (step < end - begin && is_before(begin[step])) step *= 2;
  return std::partition_point(begin, begin + std::min(step + 1, end - begin), is_before);
}

// By ascending point.
std::span<const Observation> ObservationsOf(const MapSnapshot& map, KeyFrameId keyframe) {
  const Observation* const all_end = map.observations.data() + map.observations.size();
  const Observation* const begin = std::partition_point(
      map.observations.data(), all_end, [keyframe](const Observation& o) { return o.keyframe < keyframe; });
  return {begin,
          FirstNot(begin, all_end, [keyframe](const Observation& o) { return o.keyframe <= keyframe; })};
}

// Squared difference between two views of a point: the angle between the lines of sight, approximated by its
// chord, and the ratio r of the distances, as (r - 1/r) / 3, about 2/3 of its logarithm.
double SquaredViewDifference(const Eigen::Vector3d& view, const Eigen::Vector3d& other) {
  const double a = view.squaredNorm(), b = other.squaredNorm();
  if (!(a > 0 && b > 0)) return std::numeric_limits<double>::infinity();
  const double squared_chord = 2 - 2 * view.dot(other) / std::sqrt(a * b);
  return squared_chord + (a / b + b / a - 2) / 9;
}

}  // namespace

std::optional<std::string> NearbyPointOptions::Validate() const {
  return OptionCheck()
      .AtLeast(frames, 1, "number of frames of a selection")
      .That(keyframes > 0, "The points of at least one keyframe must be searched.")
      .That(examined_keyframes >= keyframes, "At least as many keyframes must be examined as are searched.")
      .Positive(max_source_difference, "difference from the source view")
      .Ratio(max_difference_ratio, "ratio of the differences of two source views")
      .fault();
}

void NearbyPoints::Update(const MapSnapshot& map, const Rigid3& camera_from_map,
                          const std::vector<MapPointId>& seen, PanoramaId panorama,
                          const Eigen::Vector3d& pivot) {
  const bool same_map = map_ == &map && revision_ == map.revision;
  if (!same_map || ++age_frames_ >= options_.frames || seen.empty()) {
    ChooseFinite(map, camera_from_map, seen);
    age_frames_ = 0;
  }
  const bool has_pivot = !pivot.isZero(0);
  if (!same_map || panorama != panorama_ || has_pivot != has_pivot_) {
    panorama_ = panorama;
    has_pivot_ = has_pivot;
    infinite_.clear();
    if (panorama != kNoId) ChooseInfinite(map);
  }
  map_ = &map;
  revision_ = map.revision;
}

// Selects the points of the keyframes that share the most points with the last frame; without a last frame,
// of those nearest to the predicted pose. A point that only distant keyframes observe is probably occluded
// here, and its failed search would lower the inlier ratio although tracking works (ptamm §5.2).
void NearbyPoints::ChooseFinite(const MapSnapshot& map, const Rigid3& camera_from_map,
                                const std::vector<MapPointId>& seen) {
  ranked_.clear();
  const Eigen::Vector3d center = camera_from_map.OriginInSource();
  for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
    const KeyFrame& keyframe = map.keyframes[i];
    // Its points are infinite and belong to its panorama map.
    if (keyframe.kind == KeyFrameKind::kPanorama) continue;
    const double distance = (keyframe.camera_from_map.OriginInSource() - center).norm() / keyframe.mean_depth;
    const double angle_term =
        1.0 - std::abs((camera_from_map.rotation.inverse() * keyframe.camera_from_map.rotation)
                           .quaternion()
                           .w());  // grows with the angle between the views, 0 for none
    ranked_.emplace_back(1.0 - 1.0 / (1.0 + distance + 10 * angle_term), i);
  }
  const auto keep_best = [this](std::size_t most) {
    if (ranked_.size() <= most) return;
    std::nth_element(ranked_.begin(), ranked_.begin() + static_cast<std::ptrdiff_t>(most), ranked_.end());
    ranked_.resize(most);
  };
  keep_best(options_.examined_keyframes);
  // Shared points come first; distance decides among keyframes that share equally many.
  wanted_.Clear(map.next_point);
  for (const MapPointId id : seen) wanted_.Insert(id);
  for (auto& [rank, index] : ranked_) {
    int shared = 0;
    for (const Observation& observation : ObservationsOf(map, map.keyframes[index].id))
      shared += wanted_.Contains(observation.point);
    rank -= shared;
  }
  keep_best(options_.keyframes);
  std::sort(ranked_.begin(), ranked_.end());
  wanted_.Clear(map.next_point);
  for (const auto& [rank, index] : ranked_) {
    for (const Observation& observation : ObservationsOf(map, map.keyframes[index].id))
      wanted_.Insert(observation.point);
  }
  CopyWanted(map, false, &finite_);
  ChooseSources(map, camera_from_map);
}

// Selects the infinite points that keyframes of the panorama map observe.
void NearbyPoints::ChooseInfinite(const MapSnapshot& map) {
  wanted_.Clear(map.next_point);
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.panorama != panorama_) continue;
    for (const Observation& observation : ObservationsOf(map, keyframe.id)) wanted_.Insert(observation.point);
  }
  CopyWanted(map, true, &infinite_);
}

void NearbyPoints::CopyWanted(const MapSnapshot& map, bool infinite, std::vector<NearbyPoint>* points) {
  points->clear();
  double nearness = 0;  // assumed inverse depth of infinite points, 1 / map unit
  if (infinite && has_pivot_) {
    const PanoramaMap* panorama = map.FindPanorama(panorama_);
    const KeyFrame* reference = panorama ? map.FindKeyFrame(panorama->reference) : nullptr;
    if (reference && reference->mean_depth > 0) nearness = 1 / reference->mean_depth;
  }
  const MapPoint* next = map.points.data();
  const MapPoint* const end = next + map.points.size();
  // Source of the previous point: points of one keyframe have consecutive ids.
  const KeyFrame* source = nullptr;
  wanted_.ForEach([&](MapPointId id) {
    next = FirstNot(next, end, [id](const MapPoint& point) { return point.id < id; });
    if (next == end || next->id != id || next->infinite() != infinite) return;
    if (infinite && next->panorama != panorama_) return;
    if (!source || source->id != next->source_keyframe) source = map.FindKeyFrame(next->source_keyframe);
    if (!source) return;
    Eigen::Vector4d point_in_map = next->point_in_map;
    if (infinite) point_in_map += nearness * source->camera_from_map.OriginInSource().homogeneous();
    points->push_back({next, source, id, next->normal, point_in_map});
  });
}

// The first view of a point is the reference of all other measurements and remains the source where possible.
// From a very different angle or distance a warped patch no longer resembles the point: then the patch is
// taken from the selected keyframe with the most similar view (ptamm §2.1 uses the first view only).
void NearbyPoints::ChooseSources(const MapSnapshot& map, const Rigid3& camera_from_map) {
  const Eigen::Vector3d center = camera_from_map.OriginInSource();
  const double max_difference = options_.max_source_difference * options_.max_source_difference;
  const double ratio = options_.max_difference_ratio * options_.max_difference_ratio;
  poorly_viewed_.clear();
  const KeyFrame* source = nullptr;
  Eigen::Vector3d source_center = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < finite_.size(); ++i) {
    if (finite_[i].source != source) {
      source = finite_[i].source;
      source_center = source->camera_from_map.OriginInSource();
    }
    const Eigen::Vector3d position = finite_[i].point_in_map.head<3>();
    const double difference = SquaredViewDifference(source_center - position, center - position);
    if (difference > max_difference)
      poorly_viewed_.push_back({finite_[i].id, static_cast<std::uint32_t>(i), ratio * difference});
  }
  reassigned_.clear();
  reassigned_.reserve(poorly_viewed_.size());
  if (poorly_viewed_.empty()) return;
  for (const auto& [rank, index] : ranked_) {
    const KeyFrame& keyframe = map.keyframes[index];
    const Eigen::Vector3d keyframe_center = keyframe.camera_from_map.OriginInSource();
    PoorlyViewed* next = poorly_viewed_.data();
    PoorlyViewed* const end = next + poorly_viewed_.size();
    for (const Observation& observation : ObservationsOf(map, keyframe.id)) {
      while (next != end && next->point < observation.point) ++next;
      if (next == end) break;
      if (next->point != observation.point) continue;
      const Eigen::Vector3d position = finite_[next->index].point_in_map.head<3>();
      const double difference = SquaredViewDifference(keyframe_center - position, center - position);
      if (difference < next->max_difference) ReplaceSource(keyframe, observation, difference, next);
    }
  }
}

void NearbyPoints::ReplaceSource(const KeyFrame& keyframe, const Observation& observation, double difference,
                                 PoorlyViewed* poor) {
  NearbyPoint& nearby = finite_[poor->index];
  // The patch is sampled at the observed pixel, not at the projection, so that a calibration error remains
  // visible in the residuals. Both must agree within one sigma.
  const auto pixel =
      keyframe.camera->Project(keyframe.camera_from_map * Eigen::Vector3d(nearby.point_in_map.head<3>()));
  if (!pixel) return;
  const float sigma = static_cast<float>(1 << observation.level);
  if ((pixel->cast<float>() - observation.pixel).squaredNorm() > sigma * sigma) return;
  poor->max_difference = difference;
  if (poor->reassigned < 0) {
    poor->reassigned = static_cast<std::int32_t>(reassigned_.size());
    reassigned_.push_back(*nearby.point);
    nearby.point = &reassigned_.back();
  }
  MapPoint& point = reassigned_[static_cast<std::size_t>(poor->reassigned)];
  point.source_keyframe = keyframe.id;
  point.source_level = observation.level;
  point.source_pixel = LevelFromLevelZero(observation.pixel.cast<double>(), observation.level).cast<float>();
  nearby.source = &keyframe;
}

}  // namespace docent::engine
