// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/point_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace docent::engine {

namespace {

constexpr std::size_t kCacheSlots = 16384;
// The patch is resampled if the warp differs by more than this from the one it was sampled with.
constexpr float kWarpTolerance = 0.08f;
// Range of the ratio between the areas of a patch pixel and of a pixel of the search level.
constexpr float kMinAreaRatio = 0.25f;
constexpr float kMaxAreaRatio = 3.0f;

}  // namespace

std::optional<std::string> SearchOptions::Validate() const {
  return OptionCheck()
      .Within(min_corner_correlation, -1, 1, "correlation at which a patch is aligned")
      .Within(min_correlation, -1, 1, "correlation of an aligned patch")
      .Within(min_direct_correlation, -1, 1, "correlation of a patch without keypoint")
      .Positive(max_direct_shift_px, "shift of a patch without keypoint")
      .Ratio(min_view_cosine, "cosine of the angle of view")
      .fault();
}

void PointSearcher::Clear() {
  cache_.clear();
  patches_.clear();
}

void PointSearcher::Release() {
  std::vector<Cached>().swap(cache_);
  std::vector<PatchTemplate>().swap(patches_);
}

PatchTemplate& PointSearcher::PatchOf(Cached* entry) {
  if (entry->patch < 0) {
    if (patches_.empty()) patches_.reserve(kCacheSlots);
    entry->patch = static_cast<int>(patches_.size());
    patches_.emplace_back();
  }
  return patches_[static_cast<std::size_t>(entry->patch)];
}

PointSearcher::Cached& PointSearcher::Entry(const MapPoint& point) {
  if (cache_.empty()) cache_.resize(kCacheSlots);
  Cached& entry = cache_[point.id % kCacheSlots];
  if (entry.id != point.id || entry.source_keyframe != point.source_keyframe ||
      entry.source_level != point.source_level || entry.source_pixel != point.source_pixel) {
    entry.id = point.id;
    entry.source_keyframe = point.source_keyframe;
    entry.source_level = point.source_level;
    entry.source_pixel = point.source_pixel;
    entry.has_rays = entry.has_patch = false;
  }
  return entry;
}

bool PointSearcher::ProjectPoint(const MapPoint& point, const CameraModel& camera,
                                 const Eigen::Matrix3d& rotation, const Rigid3& camera_from_map,
                                 const Eigen::Vector4d& point_in_map, PredictedPoint* predicted) const {
  Eigen::Vector3d& x = predicted->point_in_camera;
  x = rotation * point_in_map.head<3>() + point_in_map[3] * camera_from_map.translation;
  if (!camera.Project(x, &predicted->pixel, &predicted->jacobian)) return false;
  if (!camera.IsInside(predicted->pixel, kPatchSize / 2)) return false;
  const Eigen::Vector3d normal = rotation * point.normal.cast<double>();
  return -normal.dot(x) >= options_.min_view_cosine * x.norm();
}

// Computes the displacement of one source pixel on the surface, approximated by its tangent plane.
bool PointSearcher::ComputeSurfaceSteps(const MapPoint& point, const KeyFrame& source,
                                        const Eigen::Vector4d& point_in_map, PredictedPoint* predicted) {
  Cached& entry = Entry(point);
  if (!entry.has_rays) {
    const Eigen::Vector2d pixel = point.source_pixel.cast<double>();
    const auto ray = source.camera->Unproject(LevelZeroFromLevel(pixel, point.source_level));
    const auto right =
        source.camera->Unproject(LevelZeroFromLevel(pixel + Eigen::Vector2d::UnitX(), point.source_level));
    const auto down =
        source.camera->Unproject(LevelZeroFromLevel(pixel + Eigen::Vector2d::UnitY(), point.source_level));
    if (!ray || !right || !down) return false;
    entry.ray = ray->cast<float>();
    entry.ray_right = right->cast<float>();
    entry.ray_down = down->cast<float>();
    entry.has_rays = true;
  }
  const Eigen::Matrix3d source_from_map = source.camera_from_map.rotation.matrix();
  const Eigen::Vector3d normal_in_source = source_from_map * point.normal.cast<double>();
  const Eigen::Vector3d point_in_source =
      source_from_map * point_in_map.head<3>() + point_in_map[3] * source.camera_from_map.translation;
  const double distance = normal_in_source.dot(point_in_source);
  const Eigen::Vector3d ray = entry.ray.cast<double>();
  const Eigen::Vector3d ray_right = entry.ray_right.cast<double>(), ray_down = entry.ray_down.cast<double>();
  const double along = normal_in_source.dot(ray);
  const double along_right = normal_in_source.dot(ray_right), along_down = normal_in_source.dot(ray_down);
  if (!(along < -0.05 && along_right < -0.05 && along_down < -0.05)) return false;
  const Eigen::Vector3d center = ray * (distance / along);
  Eigen::Matrix<double, 3, 2> steps_in_source;
  steps_in_source.col(0) = ray_right * (distance / along_right) - center;
  steps_in_source.col(1) = ray_down * (distance / along_down) - center;
  predicted->steps_in_map = source_from_map.transpose() * steps_in_source;
  return true;
}

// Computes the warp of the patch in the present image, and the level on which it has about its original size.
bool PointSearcher::ComputeWarp(const Eigen::Matrix3d& rotation, PredictedPoint* predicted) {
  const Eigen::Matrix<double, 3, 2> steps_in_camera = rotation * predicted->steps_in_map;
  predicted->pixel_from_source = (predicted->jacobian * steps_in_camera).cast<float>();
  float area = std::abs(predicted->pixel_from_source.determinant());
  predicted->level = 0;
  while (area > kMaxAreaRatio && predicted->level < kPyramidLevels - 1) {
    ++predicted->level;
    area *= 0.25f;
  }
  return area >= kMinAreaRatio && area <= kMaxAreaRatio;
}

std::optional<PredictedPoint> PointSearcher::Predict(const MapPoint& point, const KeyFrame& source,
                                                     const CameraModel& camera, const Rigid3& camera_from_map,
                                                     const Eigen::Vector4d& point_in_map) {
  PredictedPoint predicted;
  const Eigen::Matrix3d rotation = camera_from_map.rotation.matrix();
  if (!ProjectPoint(point, camera, rotation, camera_from_map, point_in_map, &predicted) ||
      !ComputeSurfaceSteps(point, source, point_in_map, &predicted) || !ComputeWarp(rotation, &predicted))
    return std::nullopt;
  return predicted;
}

bool PointSearcher::Repredict(const MapPoint& point, const CameraModel& camera, const Rigid3& camera_from_map,
                              const Eigen::Vector4d& point_in_map, PredictedPoint* predicted) const {
  const Eigen::Matrix3d rotation = camera_from_map.rotation.matrix();
  return ProjectPoint(point, camera, rotation, camera_from_map, point_in_map, predicted) &&
         ComputeWarp(rotation, predicted);
}

bool PointSearcher::PreparePatch(const MapPoint& point, const KeyFrame& source,
                                 const PredictedPoint& predicted, Cached* entry) {
  const float scale = 1.0f / static_cast<float>(1 << predicted.level);
  if (entry->has_patch && entry->level == predicted.level &&
      (entry->pixel_from_source - predicted.pixel_from_source).cwiseAbs().maxCoeff() * scale <
          kWarpTolerance) {
    return true;
  }
  entry->level = predicted.level;
  entry->pixel_from_source = predicted.pixel_from_source;
  const Eigen::Matrix2f source_from_patch = (predicted.pixel_from_source * scale).inverse();
  source.features->MarkInUse();
  entry->has_patch = CutPatch(source.features->levels[point.source_level], point.source_pixel,
                              source_from_patch, &PatchOf(entry));
  return entry->has_patch;
}

std::optional<FoundPoint> PointSearcher::Find(const MapPoint& point, const KeyFrame& source,
                                              const PredictedPoint& predicted, const ImageFeatures& features,
                                              float radius_px, bool direct) {
  Cached& entry = Entry(point);
  if (!PreparePatch(point, source, predicted, &entry)) return std::nullopt;
  features.MarkInUse();
  const PatchTemplate& patch = PatchOf(&entry);
  const auto level = static_cast<std::size_t>(predicted.level);
  const cv::Mat& image = features.levels[level];
  const Eigen::Vector2f center = LevelFromLevelZero(predicted.pixel, predicted.level).cast<float>();
  const float radius = radius_px / static_cast<float>(1 << level) + 1.0f;

  const std::vector<int>& row_begin = features.row_begin[level];
  const std::vector<Corner>& corners = features.corners[level];
  const int first_row = std::clamp(static_cast<int>(center.y() - radius), 0, image.rows - 1);
  const int last_row = std::clamp(static_cast<int>(center.y() + radius) + 1, 0, image.rows);
  const bool tolerant = comparison_ == PatchComparison::kTolerant;
  float best = options_.min_corner_correlation;
  const Corner* best_corner = nullptr;
  for (int i = row_begin[static_cast<std::size_t>(first_row)];
       i < row_begin[static_cast<std::size_t>(last_row)]; ++i) {
    const Corner& corner = corners[static_cast<std::size_t>(i)];
    const float dx = static_cast<float>(corner.x) - center.x(),
                dy = static_cast<float>(corner.y) - center.y();
    if (dx * dx + dy * dy > radius * radius) continue;
    const float correlation = tolerant ? TolerantPatchCorrelation(patch, image, corner.x, corner.y)
                                       : PatchCorrelation(patch, image, corner.x, corner.y);
    if (correlation > best) {
      best = correlation;
      best_corner = &corner;
    }
  }
  if (best_corner) {
    const Eigen::Vector2f start{best_corner->x, best_corner->y};
    const auto aligned =
        tolerant ? AlignPatchTolerantly(patch, image, start) : AlignPatch(patch, image, start);
    if (aligned && aligned->correlation >= options_.min_correlation) {
      return FoundPoint{LevelZeroFromLevel(aligned->pixel.cast<double>(), predicted.level).cast<float>(),
                        aligned->correlation};
    }
  }
  if (direct && PatchFits(image, center.x(), center.y(), 2.0f)) {
    const float shift_px = options_.max_direct_shift_px;
    const auto aligned = tolerant ? AlignPatchTolerantly(patch, image, center, shift_px)
                                  : AlignPatch(patch, image, center, shift_px);
    if (aligned && aligned->correlation >= options_.min_direct_correlation) {
      return FoundPoint{LevelZeroFromLevel(aligned->pixel.cast<double>(), predicted.level).cast<float>(),
                        aligned->correlation};
    }
  }
  return std::nullopt;
}

}  // namespace docent::engine
