// SPDX-License-Identifier: Apache-2.0
#include "ui/sound_marker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "content/flat_image.h"

namespace docent::ui {
namespace {

constexpr int kMarkerPx = 128;
constexpr double kShareOfRange = 0.08, kLeastAngle = 1.0 / 30, kMostAngle = 1.0 / 8;

// RGBA; transparent outside the disk.
cv::Mat MarkerImage() {
  const cv::Scalar ground(24, 92, 170, 255), ink(245, 245, 240, 255);
  cv::Mat image(kMarkerPx, kMarkerPx, CV_8UC4, cv::Scalar(24, 92, 170, 0));
  const cv::Point middle(kMarkerPx / 2, kMarkerPx / 2);
  cv::circle(image, middle, kMarkerPx / 2 - 2, ground, cv::FILLED, cv::LINE_AA);
  cv::circle(image, middle, kMarkerPx / 2 - 5, ink, 5, cv::LINE_AA);
  const std::vector<cv::Point> speaker = {{30, 52}, {44, 52}, {64, 34}, {64, 94}, {44, 76}, {30, 76}};
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{speaker}, ink, cv::LINE_AA);
  for (const int radius : {14, 26})
    cv::ellipse(image, {70, 64}, {radius, radius}, 0, -50, 50, ink, 6, cv::LINE_AA);
  return image;
}

}  // namespace

std::shared_ptr<const content::Model> SoundMarkerModel() {
  static const std::shared_ptr<const content::Model> kModel = [] {
    const cv::Mat rgba = MarkerImage();
    content::Image image;
    image.width_px = image.height_px = kMarkerPx;
    image.rgba.assign(rgba.datastart, rgba.dataend);
    return content::FlatModel(std::move(image));
  }();
  return kModel;
}

engine::Sim3 SoundMarkerPose(const content::Sound& sound, const Eigen::Vector3d& eye_in_map) {
  const Eigen::Vector3d to_reader = eye_in_map - sound.position;
  const double distance = to_reader.norm();
  engine::Sim3 pose;
  pose.translation = sound.position;
  pose.scale = kShareOfRange * sound.range;
  if (!(distance > 0)) return pose;
  pose.scale = std::clamp(pose.scale, kLeastAngle * distance, kMostAngle * distance);
  const Eigen::Vector3d front = to_reader / distance;
  // The map's y axis points roughly down (docs/coordinates.md).
  Eigen::Vector3d right = -Eigen::Vector3d::UnitY().cross(front);
  if (right.norm() < 1e-6) right = front.unitOrthogonal();
  right.normalize();
  Eigen::Matrix3d axes;
  axes << right, front.cross(right), front;
  pose.rotation = engine::Rotation3(axes);
  return pose;
}

}  // namespace docent::ui
