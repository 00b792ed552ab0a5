// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/panorama_image.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "engine/base/error.h"
#include "engine/map/upright_axes.h"

namespace docent::app {

namespace {

constexpr double kFullCircle = 2 * std::numbers::pi;

// The keyframes of a panorama map, and localized keyframes of other panorama maps near its centre.
std::vector<const engine::KeyFrame*> KeyFramesAbout(const engine::MapSnapshot& map,
                                                    const engine::PanoramaMap& panorama,
                                                    double max_center_distance) {
  const engine::KeyFrame& reference = *map.FindKeyFrame(panorama.reference);
  const Eigen::Vector3d center = reference.camera_from_map.OriginInSource();
  std::vector<const engine::KeyFrame*> about;
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    const bool near = (keyframe.camera_from_map.OriginInSource() - center).norm() <=
                      max_center_distance * reference.mean_depth;
    if (keyframe.panorama == panorama.id || (keyframe.panorama != engine::kNoId && near))
      about.push_back(&keyframe);
  }
  return about;
}

// Frame of the panorama: upright, with yaw 0 in the viewing direction of the reference.
engine::Rotation3 ViewFromMap(const engine::MapSnapshot& map, const engine::KeyFrame& reference) {
  const Eigen::Vector3d down = -engine::UpInMap(map);
  const Eigen::Vector3d axis =
      reference.camera_from_map.rotation.inverse() * Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  Eigen::Vector3d right = down.cross(axis);
  if (right.norm() < 1e-3)
    right = down.unitOrthogonal();  // The camera looks straight up or down, so any yaw is valid.
  right.normalize();
  Eigen::Matrix3d rows;
  rows << right.transpose(), down.transpose(), right.cross(down).transpose();
  return engine::Rotation3(rows);
}

float Sample(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const int x = std::clamp(static_cast<int>(pixel.x()), 0, image.cols - 2);
  const int y = std::clamp(static_cast<int>(pixel.y()), 0, image.rows - 2);
  const auto fx = static_cast<float>(pixel.x() - x), fy = static_cast<float>(pixel.y() - y);
  const auto* top = image.ptr<std::uint8_t>(y) + x;
  const auto* bottom = image.ptr<std::uint8_t>(y + 1) + x;
  const auto mix = [fx](const std::uint8_t* row) {
    return static_cast<float>(row[0]) + fx * static_cast<float>(row[1] - row[0]);
  };
  return mix(top) + fy * (mix(bottom) - mix(top));
}

// The first column after the longest range of columns that no keyframe covers; 0 when there is none.
int FirstColumnAfterTheGap(const std::vector<bool>& shown) {
  const int count = static_cast<int>(shown.size());
  int best_length = 0, best_end = 0, length = 0;
  for (int i = 0; i < 2 * count; ++i) {
    length = shown[static_cast<std::size_t>(i % count)] ? 0 : length + 1;
    if (length > best_length && length <= count) {
      best_length = length;
      best_end = (i + 1) % count;
    }
  }
  return best_end;
}

// The whole sphere; members as in PanoramaImage.
struct Sphere {
  cv::Mat image, shown;
};

Sphere PaintSphere(const std::vector<const engine::KeyFrame*>& keyframes,
                   const engine::Rotation3& view_from_map, double pixels_per_radian) {
  const int columns = static_cast<int>(std::lround(kFullCircle * pixels_per_radian)), rows = columns / 2;
  Sphere sphere{cv::Mat::zeros(rows, columns, CV_8UC1), cv::Mat::zeros(rows, columns, CV_8UC1)};
  std::vector<engine::Rotation3> camera_from_view;
  for (const engine::KeyFrame* keyframe : keyframes)
    camera_from_view.push_back(keyframe->camera_from_map.rotation * view_from_map.inverse());
  for (int row = 0; row < rows; ++row) {
    const double down = (row + 0.5) / pixels_per_radian - std::numbers::pi / 2;
    for (int column = 0; column < columns; ++column) {
      const double yaw = (column + 0.5) / pixels_per_radian - std::numbers::pi;
      const Eigen::Vector3d ray(std::cos(down) * std::sin(yaw), std::sin(down),
                                std::cos(down) * std::cos(yaw));
      double sum = 0, weights = 0;
      for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const engine::CameraModel& camera = *keyframes[i]->camera;
        const Eigen::Vector3d in_camera = camera_from_view[i] * ray;
        if (in_camera.z() <= 0) continue;
        const auto pixel = camera.Project(in_camera);
        if (!pixel || !camera.IsInside(*pixel)) continue;
        // Weights decrease towards the image border, so that keyframes are blended smoothly.
        const double border = std::min({pixel->x(), pixel->y(), camera.width_px() - 1 - pixel->x(),
                                        camera.height_px() - 1 - pixel->y()});
        const double weight = (border + 1) * (border + 1);
        sum += weight * static_cast<double>(Sample(keyframes[i]->features->levels[0], *pixel));
        weights += weight;
      }
      if (weights <= 0) continue;
      sphere.image.at<std::uint8_t>(row, column) = cv::saturate_cast<std::uint8_t>(sum / weights);
      sphere.shown.at<std::uint8_t>(row, column) = 255;
    }
  }
  return sphere;
}

// Shifts the columns cyclically, so that the image begins with column `first`.
cv::Mat ShiftColumns(const cv::Mat& sphere, int first) {
  cv::Mat shifted(sphere.size(), sphere.type());
  sphere.colRange(first, sphere.cols).copyTo(shifted.colRange(0, sphere.cols - first));
  if (first > 0) sphere.colRange(0, first).copyTo(shifted.colRange(sphere.cols - first, sphere.cols));
  return shifted;
}

PanoramaImage Stitch(const std::vector<const engine::KeyFrame*>& keyframes,
                     const engine::Rotation3& view_from_map, const StitchOptions& options) {
  const Sphere sphere = PaintSphere(keyframes, view_from_map, options.pixels_per_radian);
  const int columns = sphere.shown.cols, rows = sphere.shown.rows;
  std::vector<bool> shown(static_cast<std::size_t>(columns));
  int top = rows, bottom = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (sphere.shown.at<std::uint8_t>(row, column) == 0) continue;
      shown[static_cast<std::size_t>(column)] = true;
      top = std::min(top, row);
      bottom = std::max(bottom, row + 1);
    }
  }
  PanoramaImage result;
  if (top >= bottom) return result;
  const int first = FirstColumnAfterTheGap(shown);
  int width = columns;
  while (width > 1 && !shown[static_cast<std::size_t>((first + width - 1) % columns)]) --width;
  const cv::Rect part(0, top, width, bottom - top);
  result.image = ShiftColumns(sphere.image, first)(part).clone();
  result.shown = ShiftColumns(sphere.shown, first)(part).clone();
  result.keyframes = static_cast<int>(keyframes.size());
  result.pixels_per_radian = options.pixels_per_radian;
  result.view_from_map = view_from_map;
  result.left_rad = first / options.pixels_per_radian - std::numbers::pi;
  result.top_rad = top / options.pixels_per_radian - std::numbers::pi / 2;
  return result;
}

}  // namespace

Eigen::Vector2d PanoramaImage::PixelOf(const Eigen::Vector3d& direction_in_map) const {
  const Eigen::Vector3d ray = view_from_map * direction_in_map;
  const double whole = std::lround(kFullCircle * pixels_per_radian) / pixels_per_radian;
  double yaw = std::atan2(ray.x(), ray.z()) - left_rad;
  if (yaw < 0) yaw += whole;
  const double down = std::atan2(ray.y(), std::hypot(ray.x(), ray.z())) - top_rad;
  return {yaw * pixels_per_radian - 0.5, down * pixels_per_radian - 0.5};
}

std::vector<PanoramaImage> StitchPanoramas(const engine::MapSnapshot& map, const StitchOptions& options) {
  std::vector<PanoramaImage> images;
  std::set<engine::KeyFrameId> used;
  for (const engine::PanoramaMap& panorama : map.panoramas) {
    // A reference that was used in an earlier panorama belongs to the same place.
    if (used.contains(panorama.reference)) continue;
    const auto keyframes = KeyFramesAbout(map, panorama, options.max_center_distance);
    if (keyframes.size() < 2) continue;
    PanoramaImage image = Stitch(keyframes, ViewFromMap(map, *map.FindKeyFrame(panorama.reference)), options);
    if (image.image.empty()) continue;
    for (const engine::KeyFrame* keyframe : keyframes) used.insert(keyframe->id);
    image.panorama = panorama.id;
    images.push_back(std::move(image));
  }
  return images;
}

std::vector<std::uint8_t> EncodePng(const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", image, bytes)) throw Error("A stitched panorama cannot be written as PNG.");
  return bytes;
}

}  // namespace docent::app
