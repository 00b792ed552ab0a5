// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/frame_dump.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/evaluation/panorama_image.h"
#include "app/files/checked_file.h"
#include "engine/map/point_uncertainty.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

const cv::Scalar kGreen(60, 220, 60), kBlue(255, 160, 40), kRed(60, 60, 255), kGrey(170, 170, 170),
    kYellow(0, 220, 255);
constexpr double kResidualScale = 20;
constexpr int kSubpixelBits = 4;

template <typename Vector>
Json ToJson(const Vector& vector) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) json.push_back(vector[i]);
  return json;
}

Json ToJson(const engine::Rigid3& camera_from_map) {
  const Eigen::Quaterniond& q = camera_from_map.rotation.quaternion();
  return {{"translation", ToJson(camera_from_map.translation)},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

// deviation: relative standard deviation of the depth; infinite when unknown.
Json ToJson(const engine::InspectedPoint& point, float deviation) {
  Json json = {{"id", point.point},         {"infinite", point.infinite},
               {"level", point.level},      {"predicted_px", ToJson(point.predicted)},
               {"found_px", nullptr},       {"residual_px", nullptr},
               {"weight", point.weight},    {"inlier", point.inlier},
               {"depth_deviation", nullptr}};
  if (std::isfinite(deviation)) json["depth_deviation"] = deviation;
  if (point.found) json["found_px"] = ToJson(*point.found);
  if (point.residual_px) json["residual_px"] = ToJson(*point.residual_px);
  return json;
}

const char* ToString(engine::TrackingQuality quality) {
  switch (quality) {
    case engine::TrackingQuality::kGood:
      return "good";
    case engine::TrackingQuality::kPoor:
      return "poor";
    case engine::TrackingQuality::kLost:
      return "lost";
  }
  return "unknown";
}

Json Describe(std::size_t number, const engine::TrackedFrame& frame,
              const engine::FrameInspection& inspection, const std::string& hint) {
  Json json = {{"frame", number},
               {"timestamp", ToSeconds(frame.frame.time)},
               {"camera", frame.frame.camera},
               {"state", engine::ToString(frame.state)},
               {"quality_class", ToString(frame.quality_class)},
               {"quality", frame.quality},
               {"hint", hint},
               {"finite_inliers", frame.finite_points},
               {"infinite_inliers", frame.infinite_points},
               {"camera_from_map", nullptr},
               {"covariance", nullptr},
               {"predicted_camera_from_map", nullptr},
               {"map", nullptr},
               {"visible_points", inspection.visible_points},
               {"panorama", nullptr}};
  if (engine::HasPose(frame.state)) {
    json["camera_from_map"] = ToJson(frame.camera_from_map);
    Json rows = Json::array();
    for (Eigen::Index row = 0; row < 6; ++row) rows.push_back(ToJson(frame.covariance.row(row)));
    json["covariance"] = rows;
  }
  if (inspection.predicted) json["predicted_camera_from_map"] = ToJson(*inspection.predicted);
  if (frame.map) {
    json["map"] = {{"key", frame.map_key},
                   {"revision", frame.map->revision},
                   {"keyframes", frame.map->keyframes.size()},
                   {"points", frame.map->points.size()}};
  }
  if (inspection.panorama != engine::kNoId) json["panorama"] = inspection.panorama;
  Json levels = Json::array();
  if (inspection.features) {
    for (std::size_t level = 0; level < engine::kPyramidLevels; ++level) {
      levels.push_back({{"corners", inspection.features->corners[level].size()},
                        {"fast_threshold_of_next_frame", inspection.features->fast_threshold[level]}});
    }
  }
  json["levels"] = levels;
  Json points = Json::array();
  std::vector<float> deviations;
  if (frame.map) deviations = engine::RelativeDepthDeviations(*frame.map);
  for (const engine::InspectedPoint& point : inspection.points) {
    const engine::MapPoint* const known = frame.map ? frame.map->FindPoint(point.point) : nullptr;
    points.push_back(
        ToJson(point, known ? deviations[static_cast<std::size_t>(known - frame.map->points.data())]
                            : std::numeric_limits<float>::infinity()));
  }
  json["points"] = points;
  return json;
}

cv::Mat InColor(const cv::Mat& image) {
  cv::Mat color;
  if (image.channels() == 1) {
    cv::cvtColor(image, color, cv::COLOR_GRAY2BGR);
  } else {
    color = image.clone();
  }
  return color;
}

cv::Point Place(const Eigen::Vector2d& pixel) {
  constexpr double kScale = 1 << kSubpixelBits;
  return {cvRound(pixel.x() * kScale), cvRound(pixel.y() * kScale)};
}

void DrawLine(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const cv::Scalar& color,
              cv::Mat* image) {
  cv::line(*image, Place(from), Place(to), color, 1, cv::LINE_AA, kSubpixelBits);
}

void DrawCircle(const Eigen::Vector2d& pixel, double radius_px, const cv::Scalar& color, cv::Mat* image) {
  cv::circle(*image, Place(pixel), cvRound(radius_px * (1 << kSubpixelBits)), color, 1, cv::LINE_AA,
             kSubpixelBits);
}

cv::Scalar ColorOf(const engine::InspectedPoint& point) {
  if (!point.found) return kGrey;
  if (!point.inlier) return kRed;
  return point.infinite ? kBlue : kGreen;
}

cv::Mat DrawPoints(const cv::Mat& image, const engine::FrameInspection& inspection) {
  cv::Mat drawn = InColor(image);
  for (const engine::InspectedPoint& point : inspection.points) {
    const Eigen::Vector2d& at = point.found ? *point.found : point.predicted;
    DrawCircle(at, 2.0 * (1 << point.level), ColorOf(point), &drawn);
    if (point.found) DrawLine(point.predicted, *point.found, ColorOf(point), &drawn);
  }
  return drawn;
}

cv::Mat DrawResiduals(const cv::Mat& image, const engine::FrameInspection& inspection) {
  cv::Mat drawn = InColor(image);
  for (const engine::InspectedPoint& point : inspection.points) {
    if (!point.found || !point.residual_px) continue;
    DrawCircle(*point.found, 1.5, ColorOf(point), &drawn);
    DrawLine(*point.found, *point.found + kResidualScale * *point.residual_px, ColorOf(point), &drawn);
  }
  return drawn;
}

cv::Mat DrawCorners(const engine::ImageFeatures& features) {
  const cv::Mat& whole = features.levels[0];
  cv::Mat drawn(whole.rows, whole.cols + features.levels[1].cols, CV_8UC3, cv::Scalar::all(0));
  cv::Point origin;
  for (std::size_t level = 0; level < engine::kPyramidLevels; ++level) {
    const cv::Mat& image = features.levels[level];
    cv::Mat part = drawn(cv::Rect(origin, image.size()));
    cv::cvtColor(image, part, cv::COLOR_GRAY2BGR);
    for (const engine::Corner& corner : features.corners[level])
      part.at<cv::Vec3b>(corner.y, corner.x) =
          cv::Vec3b(static_cast<std::uint8_t>(kYellow[0]), static_cast<std::uint8_t>(kYellow[1]),
                    static_cast<std::uint8_t>(kYellow[2]));
    origin = level == 0 ? cv::Point(whole.cols, 0) : origin + cv::Point(0, image.rows);
  }
  return drawn;
}

void Write(const std::filesystem::path& path, const std::string& bytes) {
  CheckedFile file(path);
  file.Write(bytes);
  file.Close();
}

void WriteImage(const std::filesystem::path& path, const cv::Mat& image) {
  const std::vector<std::uint8_t> png = EncodePng(image);
  Write(path, std::string(png.begin(), png.end()));
}

}  // namespace

void WriteFrameDump(const std::filesystem::path& folder, std::size_t number,
                    const engine::TrackedFrame& frame, const engine::FrameInspection& inspection,
                    const std::string& hint) {
  const std::string name = "frame-" + std::to_string(number);
  Write(folder / (name + ".json"), Describe(number, frame, inspection, hint).dump(2) + "\n");
  if (frame.state == engine::TrackingState::kDropped || frame.frame.image.empty()) return;
  WriteImage(folder / (name + "-points.png"), DrawPoints(frame.frame.image, inspection));
  WriteImage(folder / (name + "-residuals.png"), DrawResiduals(frame.frame.image, inspection));
  if (inspection.features) WriteImage(folder / (name + "-corners.png"), DrawCorners(*inspection.features));
}

}  // namespace docent::app
