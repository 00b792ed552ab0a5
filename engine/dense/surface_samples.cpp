// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/surface_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "engine/dense/depth_map.h"

namespace docent::engine {
namespace {

// A keyframe shows a surface well that it does not see at a grazing angle, within the errors of the mesh.
constexpr double kLeastCosine = 0.3, kDepthTolerance = 0.03;
// Saturated and black pixels say nothing about brightness.
constexpr int kDarkest = 6, kBrightest = 250;

struct Place {
  Eigen::Vector3d point, normal;
};

std::vector<Eigen::Vector3d> VertexNormals(const SurfaceMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d twice_area = (mesh.vertices[b] - mesh.vertices[a])
                                           .cast<double>()
                                           .cross((mesh.vertices[c] - mesh.vertices[a]).cast<double>());
    for (const std::uint32_t vertex : {a, b, c}) normals[vertex] += twice_area;
  }
  return normals;
}

// One place after each equal step of area, in the middle of its triangle.
std::vector<Place> PlacesOf(const SurfaceMesh& mesh, std::size_t count) {
  const std::vector<Eigen::Vector3d> normals = VertexNormals(mesh);
  const auto twice_area = [&](const auto& t) {
    return static_cast<double>(
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm());
  };
  double total = 0;
  for (const auto& triangle : mesh.triangles) total += twice_area(triangle);
  const double step = total / static_cast<double>(count);
  std::vector<Place> places;
  double passed = 0;
  for (const auto& t : mesh.triangles) {
    passed += twice_area(t);
    if (passed < step) continue;
    passed = std::fmod(passed, step);
    Place place;
    place.point = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]).cast<double>() / 3;
    place.normal = normals[t[0]].normalized() + normals[t[1]].normalized() + normals[t[2]].normalized();
    if (!(place.normal.norm() > 0.5)) continue;
    place.normal.normalize();
    places.push_back(place);
  }
  return places;
}

// The distances of the mesh in a level of a keyframe, by points on its triangles that are denser than pixels.
cv::Mat DistancesIn(const KeyFrame& keyframe, const LevelRays& rays, const SurfaceMesh& mesh) {
  cv::Mat distances(rays.height_px(), rays.width_px(), CV_32FC1,
                    cv::Scalar(std::numeric_limits<float>::infinity()));
  const double pixel_angle = keyframe.camera->PixelAngle() * std::pow(2.0, rays.level());
  const auto put = [&](const Eigen::Vector3d& point) {
    const auto pixel = rays.Project(point);
    if (!pixel) return;
    const auto x = static_cast<int>(std::lround(pixel->x())), y = static_cast<int>(std::lround(pixel->y()));
    if (x < 0 || y < 0 || x >= distances.cols || y >= distances.rows) return;
    float& nearest = distances.at<float>(y, x);
    nearest = std::min(nearest, static_cast<float>(point.norm()));
  };
  std::vector<Eigen::Vector3d> in_camera;
  std::vector<char> is_seen;
  in_camera.reserve(mesh.vertices.size());
  is_seen.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    in_camera.push_back(keyframe.camera_from_map * Eigen::Vector3d(vertex.cast<double>()));
    is_seen.push_back(rays.Project(in_camera.back()).has_value() ? 1 : 0);
  }
  constexpr int kMostSteps = 24;  // Of a triangle that reaches to the camera.
  for (const auto& [a, b, c] : mesh.triangles) {
    // Triangles are small, so that one without a corner in the image covers a few pixels at its border at
    // most.
    if (is_seen[a] == 0 && is_seen[b] == 0 && is_seen[c] == 0) continue;
    const Eigen::Vector3d &p = in_camera[a], &q = in_camera[b], &r = in_camera[c];
    const double side = std::max({(q - p).norm(), (r - p).norm(), (r - q).norm()});
    const double nearest = std::min({p.norm(), q.norm(), r.norm()});
    const int steps = static_cast<int>(
        std::clamp(std::ceil(1.5 * side / (pixel_angle * nearest)), 1.0, double{kMostSteps}));
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; i + k <= steps; ++k)
        put(p + (q - p) * (static_cast<double>(i) / steps) + (r - p) * (static_cast<double>(k) / steps));
    }
  }
  return distances;
}

// The mean linear brightness of 3 x 3 pixels; empty at the border and where one is saturated or black.
std::optional<double> BrightnessAt(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const auto x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (x < 1 || y < 1 || x + 1 >= image.cols || y + 1 >= image.rows) return std::nullopt;
  double sum = 0;
  for (int v = -1; v <= 1; ++v) {
    for (int u = -1; u <= 1; ++u) {
      const int level = image.at<std::uint8_t>(y + v, x + u);
      if (level < kDarkest || level > kBrightest) return std::nullopt;
      sum += LinearFromLevel(level);
    }
  }
  return sum / 9;
}

struct Seen {
  std::uint32_t place;
  float brightness;
};

std::vector<Seen> SeenIn(const KeyFrame& keyframe, const SurfaceMesh& mesh, const std::vector<Place>& places,
                         int max_width_px) {
  keyframe.features->MarkInUse();
  int level = 0;
  while (level + 1 < kPyramidLevels && (keyframe.camera->width_px() >> level) > max_width_px) ++level;
  const LevelRays rays(*keyframe.camera, level);
  const cv::Mat& image = keyframe.features->levels[static_cast<std::size_t>(level)];
  const cv::Mat distances = DistancesIn(keyframe, rays, mesh);
  const Eigen::Vector3d eye = keyframe.camera_from_map.OriginInSource();
  std::vector<Seen> seen;
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d to_eye = eye - places[i].point;
    const double distance = to_eye.norm();
    if (places[i].normal.dot(to_eye) < kLeastCosine * distance) continue;
    const auto pixel = rays.Project(keyframe.camera_from_map * places[i].point);
    if (!pixel) continue;
    const auto brightness = BrightnessAt(image, *pixel);
    if (!brightness) continue;
    const auto x = static_cast<int>(std::lround(pixel->x())), y = static_cast<int>(std::lround(pixel->y()));
    if (distance > (1 + kDepthTolerance) * static_cast<double>(distances.at<float>(y, x))) continue;
    seen.push_back({i, static_cast<float>(*brightness)});
  }
  return seen;
}

// Mean brightness of each place by the exposures; 0 where fewer than two keyframes show it.
std::vector<double> MeansOf(const std::vector<std::vector<Seen>>& seen, const std::vector<double>& exposures,
                            std::size_t places) {
  std::vector<double> sums(places, 0);
  std::vector<int> counts(places, 0);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    for (const Seen& one : seen[k]) {
      sums[one.place] += static_cast<double>(one.brightness) / exposures[k];
      ++counts[one.place];
    }
  }
  for (std::size_t i = 0; i < places; ++i) sums[i] = counts[i] < 2 ? 0 : sums[i] / counts[i];
  return sums;
}

// The exposures of the keyframes relative to their mean, from the places that several of them show.
std::vector<double> ExposuresOf(const std::vector<std::vector<Seen>>& seen, std::size_t places) {
  std::vector<double> exposures(seen.size(), 1);
  for (int round = 0; round < 5; ++round) {
    const std::vector<double> means = MeansOf(seen, exposures, places);
    double log_sum = 0;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      std::vector<double> ratios;
      for (const Seen& one : seen[k]) {
        if (means[one.place] > 0) ratios.push_back(static_cast<double>(one.brightness) / means[one.place]);
      }
      if (ratios.size() >= 20) {
        const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
        std::nth_element(ratios.begin(), middle, ratios.end());
        exposures[k] = *middle;
      }
      log_sum += std::log(exposures[k]);
    }
    const double mean = std::exp(log_sum / static_cast<double>(seen.size()));
    for (double& exposure : exposures) exposure /= mean;
  }
  return exposures;
}

}  // namespace

double LinearFromLevel(double level) {
  const double encoded = level / 255;
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

std::vector<SurfaceSample> SampleSurfaces(const MapSnapshot& map, const SurfaceMesh& mesh, std::size_t count,
                                          int max_keyframes, int max_width_px) {
  const std::vector<Place> places = PlacesOf(mesh, count);
  std::vector<const KeyFrame*> usable;
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == KeyFrameKind::kSixDof) usable.push_back(&keyframe);
  }
  const std::size_t stride =
      std::max<std::size_t>(1, (usable.size() + static_cast<std::size_t>(max_keyframes) - 1) /
                                   static_cast<std::size_t>(max_keyframes));
  std::vector<std::vector<Seen>> seen;
  for (std::size_t i = 0; i < usable.size(); i += stride)
    seen.push_back(SeenIn(*usable[i], mesh, places, max_width_px));
  if (seen.empty()) return {};
  const std::vector<double> means = MeansOf(seen, ExposuresOf(seen, places.size()), places.size());
  std::vector<SurfaceSample> samples;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (means[i] > 0) samples.push_back({places[i].point, places[i].normal, means[i]});
  }
  return samples;
}

}  // namespace docent::engine
