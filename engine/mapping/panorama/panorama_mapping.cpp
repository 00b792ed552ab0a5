// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/panorama/panorama_mapping.h"

#include <algorithm>
#include <bitset>
#include <cmath>

#include "engine/base/option_check.h"
#include "engine/geometry/image_grid.h"
#include "engine/mapping/points/unmatched_corners.h"
#include "engine/recognition/absolute_pose.h"

namespace docent::engine {

namespace {

constexpr int kCellsAcross = 4;

// A finite point that was found in the keyframe.
struct Found {
  MapPointId point;
  Eigen::Vector2f pixel;
  int level;
};

std::vector<Found> FindFinitePoints(const KeyFrame& keyframe, const Rigid3& camera_from_map, float radius_px,
                                    Map* map, PointSearcher* searcher) {
  std::vector<Found> found;
  for (const Map::PointRecord& record : map->points()) {
    if (!record.alive || record.point.infinite()) continue;
    const Map::KeyFrameRecord* source = map->FindKeyFrame(record.point.source_keyframe);
    if (!source) continue;
    const auto predicted =
        searcher->Predict(record.point, source->keyframe, *keyframe.camera, camera_from_map);
    if (!predicted) continue;
    const auto match =
        searcher->Find(record.point, source->keyframe, *predicted, *keyframe.features, radius_px, false);
    if (match) found.push_back({record.point.id, match->pixel, predicted->level});
  }
  return found;
}

int OccupiedCells(const std::vector<Eigen::Vector2f>& pixels, const CameraModel& camera) {
  std::bitset<kCellsAcross * kCellsAcross> cells;
  for (const Eigen::Vector2f& pixel : pixels) {
    cells.set(GridCell(pixel.cast<int>().eval(), camera, kCellsAcross, kCellsAcross));
  }
  return static_cast<int>(cells.count());
}

// The pose from RANSAC over `found`, which is reduced to the inliers; their measurements are appended. Empty
// if no pose has enough inliers.
std::optional<Rigid3> PoseFrom(const LocalizationOptions& options, const KeyFrame& keyframe, Map* map,
                               std::uint64_t seed, std::vector<Found>* found,
                               std::vector<PoseMeasurement>* measurements) {
  std::vector<Eigen::Vector3d> rays, points;
  std::erase_if(*found, [&](const Found& f) {
    const auto ray = keyframe.camera->Unproject(f.pixel.cast<double>());
    if (!ray) return true;
    rays.push_back(*ray);
    points.push_back(map->FindPoint(f.point)->point.position());
    return false;
  });
  AbsolutePoseOptions pose_options;
  pose_options.pixel_angle = keyframe.camera->PixelAngle();
  pose_options.inlier_px = options.inlier_px;
  pose_options.min_inliers = options.min_inliers;
  pose_options.min_inlier_ratio = options.min_inlier_ratio;
  pose_options.seed = seed;
  const auto pose = EstimateAbsolutePose(rays, points, pose_options);
  if (!pose) return std::nullopt;
  std::vector<Found> kept;
  for (std::size_t i = 0; i < found->size(); ++i) {
    if (!pose->inlier[i]) continue;
    const Found& f = (*found)[i];
    kept.push_back(f);
    measurements->push_back({map->FindPoint(f.point)->point.point_in_map, f.pixel.cast<double>(),
                             1.0 / static_cast<double>(1 << f.level), 1.0});
  }
  *found = std::move(kept);
  return pose->camera_from_map;
}

bool IsReliable(const LocalizationOptions& options, const PoseRefinement& refined, double mean_depth) {
  if (!refined.converged || refined.sigma > options.max_sigma || refined.inliers < options.min_inliers)
    return false;
  const double variance = refined.covariance.topLeftCorner<3, 3>().trace();
  return variance > 0 && std::sqrt(variance) < options.max_position_sigma * mean_depth;
}

}  // namespace

std::optional<std::string> LocalizationOptions::Validate() const {
  return OptionCheck()
      .Positive(search_radius_px, "search radius of a panorama keyframe")
      .Positive(inlier_px, "inlier threshold of a panorama keyframe")
      .AtLeast(min_inliers, 4, "number of inliers of a panorama keyframe")
      .Ratio(min_inlier_ratio, "inlier ratio of a panorama keyframe")
      .Within(min_cells, 0, 16, "number of occupied cells of a panorama keyframe")
      .Positive(max_sigma, "residual sigma of a panorama keyframe")
      .Positive(max_position_sigma, "position sigma of a panorama keyframe")
      .fault();
}

std::optional<std::string> InfinitePointOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(max_points, [](int points) { return points >= 0; }),
            "The number of infinite points of a level must be at least 0.")
      .AtLeast(min_corner_score, 0, "corner score of an infinite point")
      .Positive(min_distance_px, "distance between infinite points")
      .fault();
}

int AddInfinitePoints(const InfinitePointOptions& options, KeyFrameId id,
                      std::span<const Eigen::Vector2f> taken, Map* map) {
  const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record || record->keyframe.panorama == kNoId) return 0;
  const KeyFrame& keyframe = record->keyframe;
  const Rotation3 map_from_camera = keyframe.camera_from_map.rotation.inverse();
  int added = 0;
  for (int level = kPyramidLevels - 1; level >= 0; --level) {
    const auto index = static_cast<std::size_t>(level);
    Occupancy occupancy(keyframe.features->levels[index], options.min_distance_px);
    for (const Eigen::Vector2f& pixel : taken)
      occupancy.Take(LevelFromLevelZero(pixel.cast<double>(), level).cast<float>());
    int accepted = 0;
    for (const ScoredCorner& scored :
         UnmatchedCorners(*record, index, options.min_corner_score, &occupancy)) {
      if (accepted >= options.max_points[index]) break;
      const Eigen::Vector2f pixel(scored.corner.x, scored.corner.y);
      if (occupancy.Taken(pixel)) continue;
      const Eigen::Vector2d pixel_zero = LevelZeroFromLevel(pixel.cast<double>(), level);
      const auto ray = keyframe.camera->Unproject(pixel_zero);
      if (!ray) continue;
      MapPoint point;
      point.point_in_map << map_from_camera * *ray, 0.0;
      point.normal = -point.position().cast<float>();
      point.panorama = keyframe.panorama;
      point.source_keyframe = id;
      point.source_level = static_cast<std::uint8_t>(level);
      point.source_pixel = pixel;
      const MapPointId point_id = map->AddPoint(point);
      map->AddObservation({id, point_id, pixel_zero.cast<float>(), static_cast<std::uint8_t>(level)});
      occupancy.Take(pixel);
      ++accepted;
    }
    added += accepted;
  }
  return added;
}

bool LocalizePanoramaKeyFrame(const LocalizationOptions& options, KeyFrameId id, std::uint64_t seed, Map* map,
                              PointSearcher* searcher, const Rigid3* guess) {
  Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record || record->keyframe.kind != KeyFrameKind::kPanorama) return false;
  std::vector<Found> found =
      FindFinitePoints(record->keyframe, guess != nullptr ? *guess : record->keyframe.camera_from_map,
                       options.search_radius_px, map, searcher);
  if (static_cast<int>(found.size()) < options.min_inliers) return false;
  std::vector<PoseMeasurement> measurements;
  const auto start = PoseFrom(options, record->keyframe, map, seed, &found, &measurements);
  if (!start) return false;
  PoseRefinementMemory memory;
  const PoseRefinement refined = RefinePose(*record->keyframe.camera, *start, {}, &measurements, &memory,
                                            {Eigen::Vector3d::Zero(), *start});
  std::vector<double> depths;
  std::vector<Eigen::Vector2f> pixels;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!(measurements[i].weight > 0.1)) continue;
    pixels.push_back(found[i].pixel);
    depths.push_back((refined.camera_from_map * measurements[i].point_in_map).z());
  }
  if (depths.empty()) return false;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  if (!IsReliable(options, refined, *middle) ||
      OccupiedCells(pixels, *record->keyframe.camera) < options.min_cells)
    return false;

  record->keyframe.camera_from_map = refined.camera_from_map;
  map->OpenPanorama(id);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!(measurements[i].weight > 0.1)) continue;
    map->AddObservation({id, found[i].point, found[i].pixel, static_cast<std::uint8_t>(found[i].level)});
  }
  map->UpdateDepth(record);
  RemoveDuplicateInfinitePoints(id, map);
  return true;
}

int RemoveDuplicateInfinitePoints(KeyFrameId id, Map* map) {
  constexpr float kSamePx = 2.0f;  // of the infinite point's level
  const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record) return 0;
  std::vector<Eigen::Vector2f> finite;
  std::vector<Observation> infinite;
  for (const Observation& observation : record->observations) {
    const Map::PointRecord* point = map->FindPoint(observation.point);
    if (!point) continue;
    if (point->point.infinite()) {
      infinite.push_back(observation);
    } else {
      finite.push_back(observation.pixel);
    }
  }
  int dropped = 0;
  for (const Observation& observation : infinite) {
    const float limit = kSamePx * static_cast<float>(1 << observation.level);
    const bool duplicate = std::any_of(finite.begin(), finite.end(), [&](const Eigen::Vector2f& pixel) {
      return (pixel - observation.pixel).squaredNorm() < limit * limit;
    });
    if (!duplicate) continue;
    map->RemovePoint(observation.point);
    ++dropped;
  }
  return dropped;
}

int RemoveInfiniteOutliers(PanoramaId panorama, Map* map) {
  // In pixels of the level. The translation of a camera that is assumed to rotate about its centre shifts the
  // whole image alike, by less than this between keyframes that see the same point.
  constexpr double kMaxErrorPx = 6;
  std::vector<Observation> outliers;
  for (const auto& [id, record] : map->keyframes()) {
    if (record.keyframe.panorama != panorama) continue;
    const Rotation3& camera_from_map = record.keyframe.camera_from_map.rotation;
    const double pixel_angle = record.keyframe.camera->PixelAngle();
    for (const Observation& observation : record.observations) {
      const Map::PointRecord* point = map->FindPoint(observation.point);
      if (!point || !point->point.infinite() || point->observers.size() < 3) continue;
      const auto ray = record.keyframe.camera->Unproject(observation.pixel.cast<double>());
      if (!ray) continue;
      const Eigen::Vector3d expected = camera_from_map * point->point.position();
      const double angle = std::atan2(ray->cross(expected).norm(), ray->dot(expected));
      if (angle > kMaxErrorPx * (1 << observation.level) * pixel_angle) outliers.push_back(observation);
    }
  }
  for (const Observation& observation : outliers) {
    map->RemoveObservation(observation.keyframe, observation.point);
    if (Map::PointRecord* point = map->FindPoint(observation.point)) map->UpdateDirection(point);
  }
  return static_cast<int>(outliers.size());
}

}  // namespace docent::engine
