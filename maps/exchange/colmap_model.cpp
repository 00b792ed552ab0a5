// SPDX-License-Identifier: Apache-2.0
#include "maps/exchange/colmap_model.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <opencv2/core/mat.hpp>

#include "maps/storage/byte_stream.h"
#include "maps/storage/map_codec.h"

namespace docent::maps {

namespace {

using engine::LensModel;

constexpr double kPixelOffset = 0.5;  // From Docent's pixel coordinates to COLMAP's.

// Formats numbers in the shortest form that reads back as the same number, independently of the locale.
class Line {
 public:
  template <typename Number>
  Line& Add(Number number) {
    std::array<char, 32> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
    return Add(std::string_view(text.data(), static_cast<std::size_t>(end - text.data())));
  }
  Line& Add(std::string_view word) {
    if (!text_.empty()) text_ += ' ';
    text_ += word;
    return *this;
  }
  std::string Take() {
    text_ += '\n';
    return std::move(text_);
  }

 private:
  std::string text_;
};

std::string CameraLine(std::size_t id, const engine::CameraModel& camera) {
  const auto& k = camera.intrinsics();
  const auto& d = camera.distortion();
  const char* model = "OPENCV_FISHEYE";
  std::vector<double> lens = {d[0], d[1], d[2], d[3]};
  if (camera.lens() == LensModel::kFov) {
    model = "FOV";
    lens = {d[0]};
  } else if (camera.lens() == LensModel::kRadialTangential && d[4] == 0) {
    model = "OPENCV";
  } else if (camera.lens() == LensModel::kRadialTangential) {
    model = "FULL_OPENCV";
    lens = {d[0], d[1], d[2], d[3], d[4], 0, 0, 0};
  }
  Line line;
  line.Add(id).Add(std::string_view(model)).Add(k.width_px).Add(k.height_px);
  line.Add(k.fx).Add(k.fy).Add(k.cx + kPixelOffset).Add(k.cy + kPixelOffset);
  for (const double number : lens) line.Add(number);
  return line.Take();
}

std::string ImageName(engine::KeyFrameId id) {
  std::string digits = std::to_string(id);
  return "keyframe" + std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits + ".png";
}

// What is accumulated for a point over the keyframes that observe it.
struct Track {
  std::string text;
  double error_px = 0;
  int length = 0;
};

int GrayAt(const engine::MapSnapshot& map, const engine::MapPoint& point) {
  const engine::KeyFrame* const source = map.FindKeyFrame(point.source_keyframe);
  if (!source || !source->features) return 128;
  const cv::Mat& level = source->features->levels[point.source_level];
  if (level.empty()) return 128;
  const int x = std::clamp(static_cast<int>(std::lround(point.source_pixel.x())), 0, level.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(point.source_pixel.y())), 0, level.rows - 1);
  return level.at<std::uint8_t>(y, x);
}

// The second line of a keyframe in images.txt, which lists its observations.
std::string ObservationsLine(const engine::MapSnapshot& map, const engine::KeyFrame& keyframe,
                             std::span<const engine::Observation> observations,
                             std::map<engine::MapPointId, Track>* tracks) {
  Line line;
  int index = 0;
  for (const engine::Observation& observation : observations) {
    const engine::MapPoint* const point = map.FindPoint(observation.point);
    const bool finite = point && !point->infinite();
    line.Add(observation.pixel.x() + kPixelOffset).Add(observation.pixel.y() + kPixelOffset);
    line.Add(finite ? std::int64_t{observation.point} + 1 : std::int64_t{-1});
    if (finite) {
      Track& track = (*tracks)[observation.point];
      track.text += ' ' + std::to_string(std::uint64_t{keyframe.id} + 1) + ' ' + std::to_string(index);
      const auto pixel = keyframe.camera->Project(keyframe.camera_from_map * point->position());
      if (pixel) track.error_px += (*pixel - observation.pixel.cast<double>()).norm();
      ++track.length;
    }
    ++index;
  }
  return line.Take();
}

}  // namespace

ColmapModel MakeColmapModel(const engine::MapSnapshot& map) {
  ColmapModel model;
  std::vector<StoredKeyFrame> keyframes;
  for (const engine::KeyFrame& keyframe : map.keyframes) keyframes.push_back({keyframe, 0});
  const CameraTable cameras = MakeCameraTable(keyframes);
  model.cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) model.cameras += CameraLine(i + 1, *cameras[i]);
  model.images =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
  std::map<engine::MapPointId, Track> tracks;
  auto observation = map.observations.begin();
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    const auto begin = observation;
    while (observation != map.observations.end() && observation->keyframe == keyframe.id) ++observation;
    const auto camera = std::find_if(cameras.begin(), cameras.end(),
                                     [&](const auto& known) { return *known == *keyframe.camera; });
    const Eigen::Quaterniond& q = keyframe.camera_from_map.rotation.quaternion();
    const Eigen::Vector3d& t = keyframe.camera_from_map.translation;
    Line line;
    line.Add(std::uint64_t{keyframe.id} + 1).Add(q.w()).Add(q.x()).Add(q.y()).Add(q.z());
    line.Add(t.x()).Add(t.y()).Add(t.z()).Add(camera - cameras.begin() + 1);
    line.Add(std::string_view(ImageName(keyframe.id)));
    model.images += line.Take() + ObservationsLine(map, keyframe, {begin, observation}, &tracks);
    model.image_of.emplace_back(ImageName(keyframe.id), keyframe.id);
  }
  model.points3d = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (const engine::MapPoint& point : map.points) {
    if (point.infinite()) continue;
    const Track& track = tracks[point.id];
    const Eigen::Vector3d position = point.position();
    const int gray = GrayAt(map, point);
    Line line;
    line.Add(std::uint64_t{point.id} + 1).Add(position.x()).Add(position.y()).Add(position.z());
    line.Add(gray).Add(gray).Add(gray).Add(track.length > 0 ? track.error_px / track.length : 0.0);
    if (track.length > 0) line.Add(std::string_view(track.text).substr(1));
    model.points3d += line.Take();
  }
  return model;
}

std::string MakePly(const engine::MapSnapshot& map) {
  const auto finite = std::count_if(map.points.begin(), map.points.end(),
                                    [](const engine::MapPoint& point) { return !point.infinite(); });
  ByteWriter body;
  for (const engine::MapPoint& point : map.points) {
    if (point.infinite()) continue;
    body.PutAll(Eigen::Vector3f(point.position().cast<float>()));
    body.PutAll(point.normal);
    for (int channel = 0; channel < 3; ++channel) body.Put(static_cast<std::uint8_t>(GrayAt(map, point)));
  }
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(finite) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    ply += std::string("property float ") + name + "\n";
  for (const char* name : {"red", "green", "blue"}) ply += std::string("property uchar ") + name + "\n";
  ply += "end_header\n";
  const Bytes& bytes = body.bytes();
  return ply.append(bytes.begin(), bytes.end());
}

}  // namespace docent::maps
