// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_verification.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdlib>
#include <set>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/geometry/image_grid.h"
#include "engine/matching/pose_refinement.h"

namespace docent::engine {
namespace {

constexpr int kFoundCells = 4;
constexpr double kInlierWeight = 0.1;

struct VerifiedPoint {
  MapPointId point = kNoId;
  Eigen::Vector2f pixel;
  int level = 0;
  double error = 0;  // distance from the prediction, in pixels of the level
};

std::vector<MapPointId> FinitePointsOf(std::span<const KeyFrameId> keyframes, Map* map) {
  std::set<MapPointId> points;
  for (const KeyFrameId id : keyframes) {
    for (const Observation& observation : map->FindKeyFrame(id)->observations) {
      const Map::PointRecord* point = map->FindPoint(observation.point);
      if (point && !point->point.infinite()) points.insert(observation.point);
    }
  }
  return {points.begin(), points.end()};
}

// At most `count` of the points, evenly selected.
std::vector<MapPointId> Subsample(const std::vector<MapPointId>& points, std::size_t count) {
  std::vector<MapPointId> some;
  const std::size_t stride = 1 + (points.size() - (points.empty() ? 0 : 1)) / count;
  for (std::size_t i = 0; i < points.size(); i += stride) some.push_back(points[i]);
  return some;
}

// *expected: the number of points that project into the image.
std::vector<VerifiedPoint> Search(std::span<const MapPointId> points, const KeyFrame& keyframe,
                                  const Rigid3& camera_from_map, float radius_px, Map* map,
                                  PointSearcher* searcher, int* expected) {
  std::vector<VerifiedPoint> found;
  *expected = 0;
  for (const MapPointId id : points) {
    const Map::PointRecord* record = map->FindPoint(id);
    const Map::KeyFrameRecord* source = map->FindKeyFrame(record->point.source_keyframe);
    if (!source) continue;
    const auto predicted =
        searcher->Predict(record->point, source->keyframe, *keyframe.camera, camera_from_map);
    if (!predicted) continue;
    ++*expected;
    const auto match =
        searcher->Find(record->point, source->keyframe, *predicted, *keyframe.features, radius_px, false);
    if (!match) continue;
    const double error = (match->pixel.cast<double>() - predicted->pixel).norm() / (1 << predicted->level);
    found.push_back({id, match->pixel, predicted->level, error});
  }
  return found;
}

PoseRefinement Refine(const std::vector<VerifiedPoint>& found, const CameraModel& camera, const Rigid3& start,
                      Map* map, std::vector<PoseMeasurement>* measurements) {
  measurements->clear();
  for (const VerifiedPoint& f : found) {
    measurements->push_back({map->FindPoint(f.point)->point.point_in_map, f.pixel.cast<double>(),
                             1.0 / static_cast<double>(1 << f.level), 1.0});
  }
  PoseRefinementMemory memory;
  return RefinePose(camera, start, {}, measurements, &memory, {Eigen::Vector3d::Zero(), start});
}

int OccupiedCells(const std::vector<VerifiedPoint>& found, const CameraModel& camera) {
  std::bitset<kFoundCells * kFoundCells> cells;
  for (const VerifiedPoint& f : found) {
    cells.set(GridCell(f.pixel.cast<int>().eval(), camera, kFoundCells, kFoundCells));
  }
  return static_cast<int>(cells.count());
}

// The finite points of the keyframes, or some of them, that this keyframe does not observe.
std::vector<MapPointId> NewPointsOf(const LoopVerificationOptions& options,
                                    std::span<const KeyFrameId> keyframes, KeyFrameId observer, Map* map) {
  std::vector<MapPointId> points = FinitePointsOf(keyframes, map);
  std::erase_if(points, [&](MapPointId point) {
    const auto& observers = map->FindPoint(point)->observers;
    return std::binary_search(observers.begin(), observers.end(), observer);
  });
  return Subsample(points, options.max_points);
}

struct LocatedKeyFrame {
  Rigid3 camera_from_map;
  std::vector<VerifiedPoint> points;  // inliers
};

// Estimates the pose of the keyframe from the points of a place: first from some of them with a wide radius,
// then from all with a narrow one. *expected: the number of points that project into the image.
std::optional<LocatedKeyFrame> LocateInPlace(const LoopVerificationOptions& options, const KeyFrame& keyframe,
                                             const std::vector<MapPointId>& points,
                                             const Rigid3& camera_from_map, Map* map, PointSearcher* searcher,
                                             int* expected) {
  const std::vector<MapPointId> some = Subsample(points, options.first_points);
  std::vector<VerifiedPoint> found =
      Search(some, keyframe, camera_from_map, options.first_radius_px, map, searcher, expected);
  if (found.size() < options.min_first_matches) return std::nullopt;
  std::vector<PoseMeasurement> measurements;
  PoseRefinement pose = Refine(found, *keyframe.camera, camera_from_map, map, &measurements);
  if (!pose.converged) return std::nullopt;
  found = Search(points, keyframe, pose.camera_from_map, options.radius_px, map, searcher, expected);
  if (static_cast<int>(found.size()) < options.min_inliers) return std::nullopt;
  pose = Refine(found, *keyframe.camera, pose.camera_from_map, map, &measurements);
  LocatedKeyFrame located{pose.camera_from_map, {}};
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (measurements[i].weight > kInlierWeight) located.points.push_back(found[i]);
  }
  const auto inliers = static_cast<int>(located.points.size());
  const double variance = pose.covariance.topLeftCorner<3, 3>().trace();
  if (!pose.converged || pose.sigma > options.max_sigma || pose.observed != ObservedMotion::kSixDof ||
      inliers < options.min_inliers || inliers < options.min_inlier_ratio * *expected ||
      OccupiedCells(located.points, *keyframe.camera) < options.min_cells ||
      !(std::sqrt(variance) <= options.max_position_sigma * pose.mean_depth))
    return std::nullopt;
  return located;
}

// The reverse check, in the coordinates of the recent points: whether those of the keyframe are found in the
// known one. Counts them in the candidate.
bool HoldsInReverse(const LoopVerificationOptions& options, const KeyFrame& keyframe, const KeyFrame& known,
                    Map* map, PointSearcher* searcher, LoopCandidate* candidate) {
  constexpr double kMaxReverseError = 3;  // pixels of the level
  Rigid3 place_from_keyframe;
  place_from_keyframe.rotation = candidate->keyframe_from_place.rotation.inverse();
  place_from_keyframe.translation =
      -(place_from_keyframe.rotation * candidate->keyframe_from_place.translation);
  const std::array<KeyFrameId, 1> own = {keyframe.id};
  int expected = 0;
  const std::vector<VerifiedPoint> back =
      Search(NewPointsOf(options, own, known.id, map), known, place_from_keyframe * keyframe.camera_from_map,
             options.radius_px, map, searcher, &expected);
  candidate->reverse_inliers = static_cast<int>(std::count_if(
      back.begin(), back.end(), [](const VerifiedPoint& f) { return f.error <= kMaxReverseError; }));
  return candidate->reverse_inliers >= options.min_reverse_inliers &&
         candidate->reverse_inliers >= options.min_reverse_ratio * expected;
}

// Pairs the points of the place that were found with the recent points that the keyframe observes at the same
// pixel. Returns the scale, which is the median ratio of their depths, recent to known; empty if too few
// agree on it.
std::optional<double> PairDuplicates(const LoopVerificationOptions& options,
                                     const Map::KeyFrameRecord& keyframe, const Rigid3& camera_from_place,
                                     const std::vector<VerifiedPoint>& found, Map* map,
                                     std::vector<DuplicatePoints>* duplicates) {
  std::vector<double> ratios;
  std::set<MapPointId> known;
  for (const VerifiedPoint& f : found) known.insert(f.point);
  for (const VerifiedPoint& f : found) {
    MapPointId nearest = kNoId;
    double least = 0, ratio = 0;
    for (const Observation& observation : keyframe.observations) {
      const double limit = options.max_duplicate_px * (1 << std::max<int>(f.level, observation.level));
      const double distance = (observation.pixel - f.pixel).norm();
      if (distance > limit || (nearest != kNoId && distance >= least)) continue;
      const Map::PointRecord* recent = map->FindPoint(observation.point);
      if (!recent || recent->point.infinite() || known.contains(observation.point)) continue;
      const double depth = (keyframe.keyframe.camera_from_map * recent->point.position()).z();
      const double known_depth = (camera_from_place * map->FindPoint(f.point)->point.position()).z();
      if (!(depth > 0) || !(known_depth > 0)) continue;
      nearest = observation.point;
      least = distance;
      ratio = depth / known_depth;
    }
    if (nearest == kNoId) continue;
    duplicates->push_back({f.point, nearest});
    ratios.push_back(std::log(ratio));
  }
  if (static_cast<int>(ratios.size()) < options.min_duplicates) return std::nullopt;
  std::vector<double> sorted = ratios;
  const double middle = Median(sorted);
  for (double& value : sorted) value = std::abs(value - middle);
  const double spread = 1.4826 * Median(sorted);
  if (spread > options.max_scale_spread) return std::nullopt;
  std::vector<DuplicatePoints> agreeing;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    if (std::abs(ratios[i] - middle) <= 3 * std::max(spread, 0.01)) agreeing.push_back((*duplicates)[i]);
  }
  *duplicates = std::move(agreeing);
  if (static_cast<int>(duplicates->size()) < options.min_duplicates) return std::nullopt;
  return std::exp(middle);
}

}  // namespace

std::optional<std::string> LoopVerificationOptions::Validate() const {
  return OptionCheck()
      .Positive(first_radius_px, "first search radius of a loop candidate")
      .Positive(radius_px, "search radius of a loop candidate")
      .That(first_points > 0 && max_points > 0, "At least one point of a loop candidate must be searched.")
      .AtLeast(min_inliers, 4, "number of inliers of a loop candidate")
      .Ratio(min_inlier_ratio, "inlier ratio of a loop candidate")
      .Within(min_cells, 0, 16, "number of occupied cells of a loop candidate")
      .Positive(max_sigma, "residual sigma of a loop candidate")
      .Positive(max_position_sigma, "position sigma of a loop candidate")
      .Positive(max_duplicate_px, "distance of duplicate points")
      .AtLeast(min_duplicates, 1, "number of duplicate points of a loop candidate")
      .Positive(max_scale_spread, "spread of the depth ratios of duplicate points")
      .AtLeast(min_reverse_inliers, 0, "number of inliers of the reverse check")
      .Ratio(min_reverse_ratio, "inlier ratio of the reverse check")
      .fault();
}

std::optional<LoopCandidate> VerifyLoopCandidate(const LoopVerificationOptions& options, KeyFrameId id,
                                                 std::span<const KeyFrameId> place,
                                                 const Rigid3& camera_from_map, Map* map,
                                                 PointSearcher* searcher) {
  const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record || place.empty()) return std::nullopt;
  LoopCandidate candidate;
  candidate.keyframe = id;
  candidate.place = place.front();
  const auto located = LocateInPlace(options, record->keyframe, NewPointsOf(options, place, id, map),
                                     camera_from_map, map, searcher, &candidate.expected);
  if (!located) return std::nullopt;
  const Rigid3& camera_from_place = located->camera_from_map;
  const auto scale =
      PairDuplicates(options, *record, camera_from_place, located->points, map, &candidate.duplicates);
  if (!scale) return std::nullopt;
  const KeyFrame& known = map->FindKeyFrame(candidate.place)->keyframe;
  candidate.keyframe_from_place = AsSim3(camera_from_place * known.camera_from_map.inverse());
  candidate.keyframe_from_place.translation *= *scale;
  candidate.keyframe_from_place.scale = *scale;
  for (const VerifiedPoint& f : located->points)
    candidate.seen.push_back({id, f.point, f.pixel, static_cast<std::uint8_t>(f.level)});
  if (!HoldsInReverse(options, record->keyframe, known, map, searcher, &candidate)) return std::nullopt;
  return candidate;
}

}  // namespace docent::engine
