// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "engine/initialization/planar_target.h"
#include "engine/recognition/absolute_pose.h"
#include "engine/vision/patch.h"

// The second step of PlanarTarget: refines an approximate pose by aligning patches.
namespace docent::engine {

namespace {

// A frame level of the alignment, coarse to fine, and the distance that a patch may move on it.
struct Stage {
  int level;
  float max_shift_px;
};
constexpr std::array<Stage, 4> kStages = {{{3, 3}, {2, 4}, {1, 3}, {0, 3}}};
// Inlier threshold on coarse levels, where points are fewer and their residuals larger.
constexpr double kCoarseInlier_px = 1.5;  // pixels of the level

}  // namespace

struct PlanarTarget::PatchMatch {
  std::uint32_t id = 0;
  Eigen::Vector3d point, ray;
  Eigen::Vector2d pixel;  // level 0
};

std::vector<PlanarTarget::PatchMatch> PlanarTarget::AlignPoints(const ImageFeatures& features,
                                                                const CameraModel& camera,
                                                                const Rigid3& camera_from_target, int level,
                                                                float max_shift_px, int* searched) const {
  std::vector<PatchMatch> matches;
  const cv::Mat& image = features.levels[static_cast<std::size_t>(level)];
  const Eigen::Matrix3d rotation = camera_from_target.rotation.matrix();
  Eigen::Matrix<double, 3, 2> model_pixel;  // metres on the target's plane per model pixel
  model_pixel << width_m_ / levels_[0].cols, 0, 0, height_m_ / levels_[0].rows, 0, 0;
  *searched = 0;
  for (std::size_t model_level = 0; model_level < kModelLevels; ++model_level) {
    for (const ModelPoint& point : points_[model_level]) {
      if (*searched >= options_.max_points_per_stage) return matches;
      const Eigen::Vector3d in_target = InTarget(point.pixel);
      const Eigen::Vector3d in_camera = rotation * in_target + camera_from_target.translation;
      // The image is not visible from behind.
      if (!(in_camera.dot(rotation.col(2)) > 0)) continue;
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian;
      if (!camera.Project(in_camera, &pixel, &jacobian)) continue;
      const Eigen::Vector2d predicted = LevelFromLevelZero(pixel, level);
      if (!PatchFits(image, static_cast<float>(predicted.x()), static_cast<float>(predicted.y()), 2))
        continue;
      const Eigen::Matrix2d level_from_model = jacobian * rotation * model_pixel / (1 << level);
      const double area = std::abs(level_from_model.determinant());
      // Each patch is taken from the model level whose resolution matches that of the frame.
      constexpr double kMaxMagnification = 16;
      if (!(area > 1e-6) || area > kMaxMagnification) continue;
      const int wanted = std::clamp(static_cast<int>(std::lround(-0.5 * std::log2(area))), 0, 100);
      if (wanted != static_cast<int>(model_level)) continue;
      PatchTemplate patch;
      const Eigen::Matrix2d source_from_patch = level_from_model.inverse() / (1 << model_level);
      if (!CutPatch(levels_[model_level],
                    LevelFromLevelZero(point.pixel, static_cast<int>(model_level)).cast<float>(),
                    source_from_patch.cast<float>(), &patch)) {
        continue;
      }
      ++*searched;
      const auto aligned = AlignPatch(patch, image, predicted.cast<float>(), max_shift_px, 12);
      if (!aligned || aligned->correlation < options_.min_correlation) continue;
      const Eigen::Vector2d found = LevelZeroFromLevel(aligned->pixel.cast<double>(), level);
      const auto ray = camera.Unproject(found);
      if (ray) matches.push_back({point.id, in_target, *ray, found});
    }
  }
  return matches;
}

std::optional<TargetDetection> PlanarTarget::Align(const ImageFeatures& features, const CameraModel& camera,
                                                   const Rigid3& camera_from_target) const {
  std::optional<TargetDetection> detection;
  Rigid3 pose = camera_from_target;
  for (const Stage& stage : kStages) {
    int searched = 0;
    const std::vector<PatchMatch> matches =
        AlignPoints(features, camera, pose, stage.level, stage.max_shift_px, &searched);
    constexpr std::size_t kMinMatches = 8;
    if (matches.size() < kMinMatches) continue;
    std::vector<Eigen::Vector3d> rays, points;
    for (const PatchMatch& match : matches) {
      rays.push_back(match.ray);
      points.push_back(match.point);
    }
    const double inlier_px = std::max(options_.aligned_px, kCoarseInlier_px * (1 << stage.level));
    Rigid3 refined = RefineAbsolutePose(rays, points, {}, pose, camera.PixelAngle(), 0.3 * inlier_px);
    std::vector<bool> inlier(matches.size());
    std::size_t count = 0;
    double squares = 0;
    for (int round = 0; round < 2; ++round) {
      count = 0;
      squares = 0;
      for (std::size_t i = 0; i < matches.size(); ++i) {
        const auto pixel = camera.Project(refined * points[i]);
        const double squared = pixel ? (*pixel - matches[i].pixel).squaredNorm() : 1e9;
        inlier[i] = squared < inlier_px * inlier_px;
        count += inlier[i];
        if (inlier[i]) squares += squared;
      }
      if (count < kMinMatches) break;
      if (round == 0)
        refined = RefineAbsolutePose(rays, points, inlier, refined, camera.PixelAngle(), 0.5 * inlier_px);
    }
    if (count < kMinMatches) continue;
    pose = refined;
    if (stage.level > 1) continue;
    // A frame that is too blurred for its finest level keeps the result of the level above.
    if (static_cast<int>(count) < options_.min_inliers ||
        static_cast<double>(count) < options_.min_inlier_ratio * searched) {
      continue;
    }
    detection.emplace();
    detection->camera_from_target = pose;
    detection->searched = searched;
    detection->rms_px = std::sqrt(squares / static_cast<double>(count));
    for (std::size_t i = 0; i < matches.size(); ++i)
      if (inlier[i]) detection->points.push_back({matches[i].id, matches[i].point, matches[i].pixel});
  }
  return detection;
}

}  // namespace docent::engine
