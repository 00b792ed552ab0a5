// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/files/text_file.h"
#include "app/simulator/simulation.h"
#include "tests/content/make_gltf.h"

// What a curator finds in an image of the simulated museum, and models of it.
namespace docent::app {

// A place that a curator points at.
struct MuseumPlace {
  Eigen::Vector2d pixel;
  Eigen::Vector3d in_world;  // Metres.
};

// The frame at this time, as events.csv writes it; -1 for none.
inline int FrameAt(const Simulation& simulation, const std::string& seconds) {
  for (int i = 0; i < simulation.frame_count(); ++i) {
    if (FormatSeconds(simulation.time(i)) == seconds) return i;
  }
  return -1;
}

// Whether the surface around a pixel is flat to a centimetre within `reach_px`.
inline bool IsFlatAt(const Simulation& simulation, int frame, const Eigen::Vector2d& pixel, double reach_px) {
  Eigen::Matrix3Xd points(3, 25);
  Eigen::Index count = 0;
  for (int row = -2; row <= 2; ++row) {
    for (int column = -2; column <= 2; ++column) {
      const auto point = simulation.SurfaceAt(frame, pixel + 0.5 * reach_px * Eigen::Vector2d(column, row));
      if (!point) return false;
      points.col(count++) = *point;
    }
  }
  const Eigen::Vector3d middle = points.rowwise().mean();
  points.colwise() -= middle;
  constexpr double kFlat_m = 0.01;
  return Eigen::JacobiSVD<Eigen::Matrix3Xd>(points).singularValues()[2] / 5 < kFlat_m;
}

// Flat places with much detail, at least 50 pixels apart, those with the most detail first.
inline std::vector<MuseumPlace> GoodPlaces(const Simulation& simulation, int frame) {
  constexpr double kReach_px = 26, kApart_px = 50;
  constexpr int kLeastCorners = 8;
  cv::Mat image, gray;
  simulation.Render(frame, &image);
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(gray, corners, 2000, 0.01, 4);
  std::vector<std::pair<int, Eigen::Vector2d>> found;
  for (double y = 90; y < 400; y += 10) {
    for (double x = 80; x < 560; x += 10) {
      const auto near = std::count_if(corners.begin(), corners.end(), [&](const cv::Point2f& corner) {
        return std::abs(corner.x - x) < kReach_px && std::abs(corner.y - y) < kReach_px;
      });
      if (near >= kLeastCorners && IsFlatAt(simulation, frame, {x, y}, kReach_px))
        found.emplace_back(static_cast<int>(near), Eigen::Vector2d(x, y));
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<MuseumPlace> places;
  for (const auto& [count, pixel] : found) {
    const bool is_apart = std::all_of(
        places.begin(), places.end(),
        [&pixel = pixel](const MuseumPlace& other) { return (other.pixel - pixel).norm() >= kApart_px; });
    if (is_apart) places.push_back({pixel, *simulation.SurfaceAt(frame, pixel)});
  }
  return places;
}

// The three places that span the largest triangle in the image, and for a fourth the one that is the farthest
// from their plane.
inline std::vector<MuseumPlace> Spread(const std::vector<MuseumPlace>& places, std::size_t count) {
  std::vector<MuseumPlace> best;
  double largest = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = i + 1; j < places.size(); ++j) {
      for (std::size_t k = j + 1; k < places.size(); ++k) {
        const Eigen::Vector2d a = places[j].pixel - places[i].pixel, b = places[k].pixel - places[i].pixel;
        const double area = std::abs(a.x() * b.y() - a.y() * b.x());
        if (area <= largest) continue;
        largest = area;
        best = {places[i], places[j], places[k]};
      }
    }
  }
  if (best.size() < 3 || count == 3) return best;
  const Eigen::Vector3d normal =
      (best[1].in_world - best[0].in_world).cross(best[2].in_world - best[0].in_world).normalized();
  const auto depth = [&](const MuseumPlace& place) {
    return std::abs(normal.dot(place.in_world - best[0].in_world));
  };
  best.push_back(*std::max_element(places.begin(), places.end(),
                                   [&](const auto& a, const auto& b) { return depth(a) < depth(b); }));
  return best;
}

// The places as a scan of them would have them, in axes of its own and without a known scale: x right, y up
// and z towards the camera of this frame.
inline std::vector<Eigen::Vector3d> ScanOf(const Simulation& simulation, int frame,
                                           const std::vector<MuseumPlace>& places) {
  constexpr double kScale = 0.37;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const MuseumPlace& place : places) middle += place.in_world / static_cast<double>(places.size());
  const engine::Rotation3 camera_from_world = simulation.world_from_camera(frame).rotation.inverse();
  std::vector<Eigen::Vector3d> scan;
  for (const MuseumPlace& place : places) {
    const Eigen::Vector3d p = camera_from_world * Eigen::Vector3d(place.in_world - middle);
    scan.push_back(kScale * Eigen::Vector3d(p.x(), -p.y(), -p.z()));
  }
  return scan;
}

// The colours of the marks, in this order, as BGR.
inline const std::vector<cv::Scalar>& MarkColors() {
  static const std::vector<cv::Scalar> kColors = {{255, 0, 255}, {255, 255, 0}, {0, 255, 0}, {255, 0, 0}};
  return kColors;
}

// A model of small square marks in full colours, whose middles are the points, parallel to its xy plane.
inline std::vector<std::uint8_t> MarksGlb(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d low = points.front(), high = low;
  for (const Eigen::Vector3d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const double half = 0.07 * (high - low).maxCoeff();
  content::GltfFile file;
  file.json["extensionsUsed"] = nlohmann::json::array({"KHR_materials_unlit"});
  nlohmann::json primitives = nlohmann::json::array();
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<float> positions;
    for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
      const Eigen::Vector3d corner = points[i] + half * Eigen::Vector3d(x, y, 0);
      for (const double value : {corner.x(), corner.y(), corner.z()})
        positions.push_back(static_cast<float>(value));
    }
    const int accessor = file.AddFloats(positions, "VEC3", 4);
    file.json["accessors"][static_cast<std::size_t>(accessor)]["min"] = {positions[0], positions[1],
                                                                         positions[2]};
    file.json["accessors"][static_cast<std::size_t>(accessor)]["max"] = {positions[6], positions[7],
                                                                         positions[8]};
    const cv::Scalar color = MarkColors().at(i) / 255.0;
    const int material = file.Add(
        "materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {color[2], color[1], color[0], 1}}}},
                      {"doubleSided", true},
                      {"extensions", {{"KHR_materials_unlit", nlohmann::json::object()}}}});
    primitives.push_back({{"attributes", {{"POSITION", accessor}}},
                          {"indices", file.AddIndices({0, 1, 2, 0, 2, 3})},
                          {"material", material}});
  }
  file.Add("meshes", {{"primitives", primitives}});
  file.Add("nodes", {{"mesh", 0}});
  file.Add("scenes", {{"nodes", {0}}});
  file.json["scene"] = 0;
  return file.Glb();
}

// A second of a tone of 440 Hz: a WAV file with 8000 samples/s of 16 bits.
inline std::string ToneWav() {
  constexpr std::uint32_t kRate = 8000;
  std::string wav;
  const auto put = [&wav](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) wav += static_cast<char>(value >> (8 * i) & 0xFF);
  };
  wav += "RIFF";
  put(36 + 2 * kRate, 4);
  wav += "WAVEfmt ";
  put(16, 4);  // Bytes of the format.
  put(1, 2);   // PCM.
  put(1, 2);   // Channels.
  put(kRate, 4);
  put(2 * kRate, 4);  // Bytes in a second,
  put(2, 2);          // in a sample of all channels,
  put(16, 2);         // and bits in one.
  wav += "data";
  put(2 * kRate, 4);
  for (std::uint32_t i = 0; i < kRate; ++i)
    put(static_cast<std::uint32_t>(
            static_cast<std::int32_t>(8000 * std::sin(2 * 3.14159265 * 440 * i / kRate))),
        2);
  return wav;
}

}  // namespace docent::app
