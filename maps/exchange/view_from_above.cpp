// SPDX-License-Identifier: Apache-2.0
#include "maps/exchange/view_from_above.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "engine/map/upright_axes.h"

namespace docent::maps {

namespace {

const cv::Scalar kPaper(250, 250, 250), kInk(60, 60, 60), kCameraColor(200, 90, 30), kFirstColor(40, 40, 210),
    kTurnedColor(90, 160, 40);

// The area of the plan that contains all keyframes and all points except outliers.
Eigen::AlignedBox2d Extent(const std::vector<Eigen::Vector2d>& cameras,
                           const std::vector<Eigen::Vector2d>& points, double ignored_ratio) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& camera : cameras) box.extend(camera);
  if (points.empty()) return box;
  Eigen::Vector2d low, high;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector2d& point : points) values.push_back(point[axis]);
    std::sort(values.begin(), values.end());
    const auto skipped = static_cast<std::size_t>(ignored_ratio * static_cast<double>(values.size()));
    low[axis] = values[skipped];
    high[axis] = values[values.size() - 1 - skipped];
  }
  box.extend(low);
  box.extend(high);
  return box;
}

void DrawScaleBar(double pixels_per_unit, int margin_px, cv::Mat* sheet) {
  // The longest of 1, 2 or 5 times a power of ten that takes at most a third of the width.
  const double most = sheet->cols / 3.0 / pixels_per_unit;
  const double power = std::pow(10.0, std::floor(std::log10(most)));
  const double length = most >= 5 * power ? 5 * power : most >= 2 * power ? 2 * power : power;
  const int y = sheet->rows - margin_px / 2;
  const int length_px = static_cast<int>(std::lround(length * pixels_per_unit));
  cv::line(*sheet, {margin_px, y}, {margin_px + length_px, y}, kInk, 2, cv::LINE_AA);
  char text[32];
  std::snprintf(text, sizeof text, "%g map units", length);
  cv::putText(*sheet, text, {margin_px + length_px + 8, y + 5}, cv::FONT_HERSHEY_SIMPLEX, 0.45, kInk, 1,
              cv::LINE_AA);
}

}  // namespace

Eigen::Matrix<double, 2, 3> SheetFromMap(const engine::MapSnapshot& map) {
  const engine::UprightAxes axes = engine::UprightAxesOf(map);
  Eigen::Matrix<double, 2, 3> sheet_from_map;
  sheet_from_map.row(0) = axes.right;
  sheet_from_map.row(1) = -axes.ahead;  // Down in the plan.
  return sheet_from_map;
}

cv::Mat DrawFromAbove(const engine::MapSnapshot& map, const ViewFromAboveOptions& options) {
  if (map.keyframes.empty()) return cv::Mat(options.size_px, options.size_px, CV_8UC3, kPaper);
  const Eigen::Matrix<double, 2, 3> sheet_from_map = SheetFromMap(map);
  std::vector<Eigen::Vector2d> cameras, points;
  for (const engine::KeyFrame& keyframe : map.keyframes)
    cameras.push_back(sheet_from_map * keyframe.camera_from_map.OriginInSource());
  for (const engine::MapPoint& point : map.points) {
    if (!point.infinite()) points.push_back(sheet_from_map * point.position());
  }
  const Eigen::AlignedBox2d box = Extent(cameras, points, options.ignored_ratio);
  const double room = options.size_px - 2.0 * options.margin_px;
  const double scale = room / std::max(1e-6, box.sizes().maxCoeff());
  const Eigen::Vector2d size = (box.sizes() * scale).array().max(room / 4) + 2.0 * options.margin_px;
  cv::Mat sheet(static_cast<int>(size.y()), static_cast<int>(size.x()), CV_8UC3, kPaper);
  const auto place = [&](const Eigen::Vector2d& on_sheet) {
    const Eigen::Vector2d pixel = (on_sheet - box.center()) * scale + size / 2;
    return cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  };
  const cv::Rect2f bounds(0, 0, static_cast<float>(sheet.cols), static_cast<float>(sheet.rows));
  for (const Eigen::Vector2d& point : points) {
    if (bounds.contains(place(point))) cv::circle(sheet, place(point), 1, kInk, cv::FILLED, cv::LINE_AA);
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Eigen::Vector3d ahead =
        map.keyframes[i].camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ();
    Eigen::Vector2d direction = sheet_from_map * ahead;
    if (direction.norm() > 1e-9) direction.normalize();
    const cv::Point2f at = place(cameras[i]);
    const cv::Point2f forward(static_cast<float>(direction.x()), static_cast<float>(direction.y()));
    const cv::Point2f aside(-forward.y, forward.x);
    const std::vector<cv::Point> triangle = {at, at + 12 * forward + 6 * aside,
                                             at + 12 * forward - 6 * aside};
    const bool turned = map.keyframes[i].kind == engine::KeyFrameKind::kPanorama;
    cv::polylines(sheet, triangle, true,
                  i == 0   ? kFirstColor
                  : turned ? kTurnedColor
                           : kCameraColor,
                  1, cv::LINE_AA);
  }
  DrawScaleBar(scale, options.margin_px, &sheet);
  return sheet;
}

}  // namespace docent::maps
