// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/panorama_image.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "app/session/surface_at_pixel.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;

// The keyframes of one place: those of a panorama map, and those that were once turned about its centre.
std::vector<const engine::KeyFrame*> KeyFramesAbout(const engine::MapSnapshot& map,
                                                    const engine::PanoramaMap& panorama, double same_place) {
  const engine::KeyFrame& reference = *map.FindKeyFrame(panorama.reference);
  const Eigen::Vector3d center = reference.camera_from_map.OriginInSource();
  std::vector<const engine::KeyFrame*> about;
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    const bool near =
        (keyframe.camera_from_map.OriginInSource() - center).norm() <= same_place * reference.mean_depth;
    if (keyframe.panorama == panorama.id || (keyframe.panorama != engine::kNoId && near))
      about.push_back(&keyframe);
  }
  return about;
}

// Upright, and looking the way the reference does.
engine::Rotation3 ViewFromMap(const engine::MapSnapshot& map, const engine::KeyFrame& reference) {
  const Eigen::Vector3d down = -UpInMap(map);
  const Eigen::Vector3d axis =
      reference.camera_from_map.rotation.inverse() * Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  Eigen::Vector3d right = down.cross(axis);
  if (right.norm() < 1e-3) right = down.unitOrthogonal();  // straight up or down: any side will do
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

// The sphere's columns that no keyframe shows: where the longest run of them ends (0 when there is none).
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

// The whole sphere; `shown` and `image` as in PanoramaImage.
struct Sphere {
  cv::Mat image, shown;
};

Sphere PaintSphere(const std::vector<const engine::KeyFrame*>& keyframes,
                   const engine::Rotation3& view_from_map, double pixels_a_radian) {
  const int columns = static_cast<int>(std::lround(kWholeTurn * pixels_a_radian)), rows = columns / 2;
  Sphere sphere{cv::Mat::zeros(rows, columns, CV_8UC1), cv::Mat::zeros(rows, columns, CV_8UC1)};
  std::vector<engine::Rotation3> camera_from_view;
  for (const engine::KeyFrame* keyframe : keyframes)
    camera_from_view.push_back(keyframe->camera_from_map.rotation * view_from_map.inverse());
  for (int row = 0; row < rows; ++row) {
    const double down = (row + 0.5) / pixels_a_radian - std::numbers::pi / 2;
    for (int column = 0; column < columns; ++column) {
      const double turn = (column + 0.5) / pixels_a_radian - std::numbers::pi;
      const Eigen::Vector3d ray(std::cos(down) * std::sin(turn), std::sin(down),
                                std::cos(down) * std::cos(turn));
      double sum = 0, weights = 0;
      for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const engine::CameraModel& camera = *keyframes[i]->camera;
        const Eigen::Vector3d in_camera = camera_from_view[i] * ray;
        if (in_camera.z() <= 0) continue;
        const auto pixel = camera.Project(in_camera);
        if (!pixel || !camera.IsInside(*pixel)) continue;
        // What is near an image's rim fades into its neighbour.
        const double rim = std::min({pixel->x(), pixel->y(), camera.width_px() - 1 - pixel->x(),
                                     camera.height_px() - 1 - pixel->y()});
        const double weight = (rim + 1) * (rim + 1);
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

// The columns from `first` on, around the sphere.
cv::Mat Turned(const cv::Mat& sphere, int first) {
  cv::Mat turned(sphere.size(), sphere.type());
  sphere.colRange(first, sphere.cols).copyTo(turned.colRange(0, sphere.cols - first));
  if (first > 0) sphere.colRange(0, first).copyTo(turned.colRange(sphere.cols - first, sphere.cols));
  return turned;
}

PanoramaImage Stitch(const std::vector<const engine::KeyFrame*>& keyframes,
                     const engine::Rotation3& view_from_map, const StitchOptions& options) {
  const Sphere sphere = PaintSphere(keyframes, view_from_map, options.pixels_a_radian);
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
  result.image = Turned(sphere.image, first)(part).clone();
  result.shown = Turned(sphere.shown, first)(part).clone();
  result.keyframes = static_cast<int>(keyframes.size());
  result.pixels_a_radian = options.pixels_a_radian;
  result.view_from_map = view_from_map;
  result.left_rad = first / options.pixels_a_radian - std::numbers::pi;
  result.top_rad = top / options.pixels_a_radian - std::numbers::pi / 2;
  return result;
}

}  // namespace

Eigen::Vector2d PanoramaImage::PixelOf(const Eigen::Vector3d& direction_in_map) const {
  const Eigen::Vector3d ray = view_from_map * direction_in_map;
  const double whole = std::lround(kWholeTurn * pixels_a_radian) / pixels_a_radian;
  double turn = std::atan2(ray.x(), ray.z()) - left_rad;
  if (turn < 0) turn += whole;
  const double down = std::atan2(ray.y(), std::hypot(ray.x(), ray.z())) - top_rad;
  return {turn * pixels_a_radian - 0.5, down * pixels_a_radian - 0.5};
}

std::vector<PanoramaImage> StitchPanoramas(const engine::MapSnapshot& map, const StitchOptions& options) {
  std::vector<PanoramaImage> images;
  std::set<engine::KeyFrameId> used;
  for (const engine::PanoramaMap& panorama : map.panoramas) {
    // A reference that is in the image of an earlier place was a dependent keyframe there.
    if (used.contains(panorama.reference)) continue;
    const auto keyframes = KeyFramesAbout(map, panorama, options.same_place);
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
