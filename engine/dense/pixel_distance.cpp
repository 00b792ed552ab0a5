// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/pixel_distance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

namespace docent::engine {

namespace {

// The grey value between pixels; empty outside of the image.
std::optional<float> Interpolate(const cv::Mat& gray, const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(std::floor(pixel.x())), y = static_cast<int>(std::floor(pixel.y()));
  if (x < 0 || y < 0 || x + 1 >= gray.cols || y + 1 >= gray.rows) return std::nullopt;
  const auto right = static_cast<float>(pixel.x() - x), below = static_cast<float>(pixel.y() - y);
  const std::uint8_t* const upper = gray.ptr(y) + x;
  const std::uint8_t* const lower = gray.ptr(y + 1) + x;
  const float first = (1 - right) * static_cast<float>(upper[0]) + right * static_cast<float>(upper[1]);
  const float second = (1 - right) * static_cast<float>(lower[0]) + right * static_cast<float>(lower[1]);
  return (1 - below) * first + below * second;
}

// The patch around the pixel: its rays, which reach the plane through the surface, perpendicular to the
// pixel's ray, at the distance of the surface; and its values without their mean.
struct PixelPatch {
  Eigen::Vector3d origin, direction;  // Of the pixel's ray, in the map; of unit length.
  std::vector<Eigen::Vector3d> rays;
  std::vector<float> values;
  float energy = 0;  // The sum of the squared values.
};

std::optional<PixelPatch> MakePatch(const cv::Mat& image, const CameraModel& camera,
                                    const Rigid3& camera_from_map, const Eigen::Vector2d& pixel,
                                    const PixelDistanceOptions& options) {
  const auto middle = camera.Unproject(pixel);
  if (!middle) return std::nullopt;
  const double spacing_px = options.spacing_px * camera.width_px() / 640;
  const int reach_px = static_cast<int>(std::ceil(options.half_size * spacing_px)) + 2;
  const cv::Point corner(static_cast<int>(pixel.x()) - reach_px, static_cast<int>(pixel.y()) - reach_px);
  const cv::Rect around =
      cv::Rect(corner, cv::Size(2 * reach_px + 1, 2 * reach_px + 1)) & cv::Rect({}, image.size());
  if (around.empty()) return std::nullopt;
  cv::Mat gray = image(around);
  if (gray.channels() == 3) cv::cvtColor(image(around), gray, cv::COLOR_BGR2GRAY);
  const Rigid3 map_from_camera = camera_from_map.inverse();
  PixelPatch patch;
  patch.origin = map_from_camera.translation;
  patch.direction = (map_from_camera.rotation * *middle).normalized();
  for (int y = -options.half_size; y <= options.half_size; ++y) {
    for (int x = -options.half_size; x <= options.half_size; ++x) {
      const Eigen::Vector2d sample = pixel + spacing_px * Eigen::Vector2d(x, y);
      const auto ray = camera.Unproject(sample);
      const auto value = Interpolate(gray, sample - Eigen::Vector2d(around.x, around.y));
      if (!ray || !value) return std::nullopt;
      const Eigen::Vector3d in_map = map_from_camera.rotation * *ray;
      patch.rays.push_back(in_map / in_map.dot(patch.direction));
      patch.values.push_back(*value);
    }
  }
  float mean = 0;
  for (const float value : patch.values) mean += value / static_cast<float>(patch.values.size());
  for (float& value : patch.values) {
    value -= mean;
    patch.energy += value * value;
  }
  return patch;
}

// The distances of the map points near the ray, or of all in view where these are few, ascending.
std::vector<double> DistancesNear(const PixelPatch& patch, const MapSnapshot& map, const CameraModel& camera,
                                  const Rigid3& camera_from_map, double near_angle) {
  std::vector<double> near, all;
  for (const MapPoint& point : map.points) {
    if (point.infinite()) continue;
    const auto seen = camera.Project(camera_from_map * point.position());
    if (!seen || !camera.IsInside(*seen)) continue;
    const Eigen::Vector3d from_camera = point.position() - patch.origin;
    all.push_back(from_camera.norm());
    if (from_camera.dot(patch.direction) > std::cos(near_angle) * all.back()) near.push_back(all.back());
  }
  constexpr std::size_t kFew = 3;
  std::vector<double>& chosen = near.size() < kFew ? all : near;
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// The keyframes whose images determine the distance of a surface best: those that see it with a parallax near
// the best one; see DepthViewOptions.
std::vector<const KeyFrame*> ChooseKeyframes(const PixelPatch& patch, double distance, const MapSnapshot& map,
                                             int max_count) {
  constexpr double kBest_deg = 8, kLess_deg = 3, kMore_deg = 12, kMin_deg = 1, kMax_deg = 35;
  const Eigen::Vector3d surface = patch.origin + distance * patch.direction;
  std::vector<std::pair<double, const KeyFrame*>> scored;
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind != KeyFrameKind::kSixDof) continue;
    const auto seen = keyframe.camera->Project(keyframe.camera_from_map * surface);
    if (!seen || !keyframe.camera->IsInside(*seen)) continue;
    const Eigen::Vector3d from_keyframe = surface - keyframe.camera_from_map.OriginInSource();
    const double parallax_deg =
        std::acos(std::clamp(from_keyframe.normalized().dot(patch.direction), -1.0, 1.0)) * 180 /
        std::numbers::pi;
    if (parallax_deg < kMin_deg || parallax_deg > kMax_deg) continue;
    const double off = (parallax_deg - kBest_deg) / (parallax_deg < kBest_deg ? kLess_deg : kMore_deg);
    scored.emplace_back(off * off, &keyframe);
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<const KeyFrame*> chosen;
  for (const auto& [score, keyframe] : scored) {
    if (static_cast<int>(chosen.size()) == max_count) break;
    keyframe->features->MarkInUse();
    chosen.push_back(keyframe);
  }
  return chosen;
}

// The correlation of the patch at this distance with a keyframe's image; empty where the image ends.
std::optional<double> Correlation(const PixelPatch& patch, double distance, const KeyFrame& keyframe,
                                  double min_contrast) {
  float sum = 0, squares = 0, products = 0;
  for (std::size_t i = 0; i < patch.rays.size(); ++i) {
    const Eigen::Vector3d point = patch.origin + distance * patch.rays[i];
    const auto pixel = keyframe.camera->Project(keyframe.camera_from_map * point);
    if (!pixel) return std::nullopt;
    const auto value = Interpolate(keyframe.features->levels[0], *pixel);
    if (!value) return std::nullopt;
    sum += *value;
    squares += *value * *value;
    products += *value * patch.values[i];
  }
  const auto count = static_cast<float>(patch.rays.size());
  const float energy = squares - sum * sum / count;
  if (energy < count * min_contrast * min_contrast) return 0;
  return products / std::sqrt(energy * patch.energy);
}

// The mean correlation in the better half of the keyframes, since the others may see something in front; -1
// where none sees the patch.
double MeanCorrelation(const PixelPatch& patch, double distance,
                       const std::vector<const KeyFrame*>& keyframes, double min_contrast,
                       std::vector<double>* memory) {
  memory->clear();
  for (const KeyFrame* keyframe : keyframes) {
    if (const auto correlation = Correlation(patch, distance, *keyframe, min_contrast))
      memory->push_back(*correlation);
  }
  if (memory->empty()) return -1;
  std::sort(memory->begin(), memory->end(), std::greater<>());
  const std::size_t half = (memory->size() + 1) / 2;
  double sum = 0;
  for (std::size_t i = 0; i < half; ++i) sum += (*memory)[i];
  return sum / static_cast<double>(half);
}

// The index of the highest correlation, between two distances, if it is high enough and leads all other
// maxima.
std::optional<double> ClearMaximum(const std::vector<double>& correlations,
                                   const PixelDistanceOptions& options) {
  constexpr std::size_t kSamePeak = 3;  // Distances beside the best one that belong to its maximum.
  const auto best = static_cast<std::size_t>(std::max_element(correlations.begin(), correlations.end()) -
                                             correlations.begin());
  // At an end of the range the surface may lie beyond it.
  if (best == 0 || best + 1 == correlations.size() || correlations[best] < options.min_correlation)
    return std::nullopt;
  for (std::size_t i = 1; i + 1 < correlations.size(); ++i) {
    const bool apart = i + kSamePeak < best || i > best + kSamePeak;
    const bool is_maximum = correlations[i] >= correlations[i - 1] && correlations[i] >= correlations[i + 1];
    if (apart && is_maximum && correlations[i] > correlations[best] - options.min_lead) return std::nullopt;
  }
  const double before = correlations[best - 1], after = correlations[best + 1];
  const double curvature = before - 2 * correlations[best] + after;
  const bool can_refine = before > -1 && after > -1 && curvature < 0;
  return static_cast<double>(best) + (can_refine ? 0.5 * (before - after) / curvature : 0);
}

}  // namespace

std::optional<double> MeasureDistance(const MapSnapshot& map, const cv::Mat& image, const CameraModel& camera,
                                      const Rigid3& camera_from_map, const Eigen::Vector2d& pixel,
                                      const PixelDistanceOptions& options) {
  const bool has_image = image.cols == camera.width_px() && image.rows == camera.height_px();
  if (!has_image || !camera.IsInside(pixel)) return std::nullopt;
  const auto patch = MakePatch(image, camera, camera_from_map, pixel, options);
  if (!patch) return std::nullopt;
  const double samples = static_cast<double>(patch->values.size());
  if (patch->energy < samples * options.min_contrast * options.min_contrast) return std::nullopt;
  const std::vector<double> distances =
      DistancesNear(*patch, map, camera, camera_from_map, options.near_angle);
  if (distances.empty()) return std::nullopt;
  const std::vector<const KeyFrame*> keyframes =
      ChooseKeyframes(*patch, distances[distances.size() / 2], map, options.max_keyframes);
  if (keyframes.empty()) return std::nullopt;
  double baseline = 0;
  for (const KeyFrame* keyframe : keyframes)
    baseline = std::max(baseline, (keyframe->camera_from_map.OriginInSource() - patch->origin).norm());
  const std::size_t ignored = distances.size() / 50;
  const double farthest = distances[distances.size() - 1 - ignored] * options.range_margin;
  const double range = options.range_margin / distances[ignored] - 1 / farthest;
  // From one distance to the next, the surface moves by a pixel in the keyframe with the longest baseline.
  const int count =
      std::clamp(static_cast<int>(range * baseline / camera.PixelAngle()) + 2, 3, options.max_distances);
  const double step = range / (count - 1);
  std::vector<double> correlations, memory;
  for (int i = 0; i < count; ++i) {
    correlations.push_back(
        MeanCorrelation(*patch, 1 / (1 / farthest + i * step), keyframes, options.min_contrast, &memory));
  }
  const auto best = ClearMaximum(correlations, options);
  if (!best) return std::nullopt;
  return 1 / (1 / farthest + *best * step);
}

}  // namespace docent::engine
