// SPDX-License-Identifier: Apache-2.0
#include "tests/maps/map_samples.h"

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <stdexcept>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "maps/storage/snapshot_reader.h"

namespace docent::maps {

namespace fs = std::filesystem;
using engine::KeyFrame;
using engine::MapPoint;
using engine::MapSnapshot;

namespace {

constexpr engine::PanoramaId kSamplePanorama = 3;  // The only one of each map, at its first keyframe.

cv::Mat MakeImage(std::uint64_t seed, int width_px, int height_px, bool corners) {
  Random random(seed);
  cv::Mat gray(height_px, width_px, CV_8UC1);
  if (corners) {
    constexpr int kBlock = 8;
    for (int y = 0; y < height_px; y += kBlock) {
      for (int x = 0; x < width_px; x += kBlock)
        gray(cv::Rect(x, y, std::min(kBlock, width_px - x), std::min(kBlock, height_px - y))) =
            cv::Scalar(random.Below(256));
    }
    return gray;
  }
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      gray.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x + y + static_cast<int>(random.Below(24)));
    }
  }
  return gray;
}

std::shared_ptr<const engine::CameraModel> MakeCamera(const SampleOptions& options, int which) {
  engine::CameraModel::Intrinsics intrinsics;
  intrinsics.width_px = options.width_px;
  intrinsics.height_px = options.height_px;
  intrinsics.fx = 0.84375 * options.width_px + which;
  intrinsics.fy = 0.84765625 * options.width_px;
  intrinsics.cx = options.width_px / 2.0 - 0.125;
  intrinsics.cy = options.height_px / 2.0;
  const auto lens = which == 0 ? engine::LensModel::kRadialTangential : engine::LensModel::kFov;
  const std::array<double, 5> distortion =
      which == 0 ? std::array<double, 5>{-0.1, 0.01, 0.001, -0.002, 0} : std::array<double, 5>{0.9};
  return std::make_shared<const engine::CameraModel>(lens, intrinsics, distortion);
}

Eigen::Vector3d RandomVector(Random& random, double size) {
  return {random.Uniform(-size, size), random.Uniform(-size, size), random.Uniform(-size, size)};
}

KeyFrame MakeKeyFrame(engine::KeyFrameId id, const Eigen::Vector3d& center, std::uint64_t seed,
                      std::shared_ptr<const engine::CameraModel> camera, bool corners = false) {
  Random random(seed);
  KeyFrame keyframe;
  keyframe.id = id;
  keyframe.kind = id % 5 == 4 ? engine::KeyFrameKind::kPanorama : engine::KeyFrameKind::kSixDof;
  if (keyframe.kind == engine::KeyFrameKind::kPanorama) keyframe.panorama = kSamplePanorama;
  keyframe.fixed = id == 0;
  keyframe.time = Timestamp(1'000'000'007 * static_cast<std::int64_t>(id + 1));
  keyframe.camera_from_map.rotation = engine::Rotation3::Exp(RandomVector(random, 1.0));
  keyframe.camera_from_map.translation = -(keyframe.camera_from_map.rotation * center);
  keyframe.mean_depth = random.Uniform(0.5, 3);
  keyframe.depth_sigma = random.Uniform(0.1, 0.5);
  keyframe.features =
      MakeSizesOnly(MakeImage(random.Next(), camera->width_px(), camera->height_px(), corners));
  keyframe.camera = std::move(camera);
  return keyframe;
}

bool Same(const KeyFrame& a, const KeyFrame& b) {
  const cv::Mat& image_a = a.features->levels[0];
  const cv::Mat& image_b = b.features->levels[0];
  // Reading normalizes a rotation, which may change its last bits.
  return a.id == b.id && a.kind == b.kind && a.panorama == b.panorama && a.fixed == b.fixed &&
         a.time == b.time &&
         a.camera_from_map.rotation.quaternion().coeffs().isApprox(
             b.camera_from_map.rotation.quaternion().coeffs(), 1e-14) &&
         a.camera_from_map.translation == b.camera_from_map.translation && a.mean_depth == b.mean_depth &&
         a.depth_sigma == b.depth_sigma && *a.camera == *b.camera && image_a.size() == image_b.size() &&
         image_a.type() == image_b.type() &&
         std::equal(image_a.begin<std::uint8_t>(), image_a.end<std::uint8_t>(),
                    image_b.begin<std::uint8_t>());
}

}  // namespace

std::shared_ptr<MapSnapshot> MakeSampleMap(std::uint64_t seed, const SampleOptions& options) {
  Random random(seed);
  auto map = std::make_shared<MapSnapshot>();
  map->revision = 1 + random.Below(1000);
  const std::array cameras = {MakeCamera(options, 0), MakeCamera(options, 1)};
  for (int i = 0; i < options.keyframes; ++i) {
    const auto id = static_cast<engine::KeyFrameId>(i + i / 2);  // Ids with gaps, as after culling.
    const Eigen::Vector3d center(0.1 * i, random.Uniform(-0.05, 0.05), random.Uniform(-0.05, 0.05));
    map->keyframes.push_back(
        MakeKeyFrame(id, center, random.Next(), cameras[i % 3 == 2 ? 1 : 0], options.corners));
  }
  map->next_keyframe = map->keyframes.empty() ? 0 : map->keyframes.back().id + 1;
  if (!map->keyframes.empty()) {
    map->panoramas.push_back({kSamplePanorama, map->keyframes.front().id});
    map->next_panorama = kSamplePanorama + 2;
    map->keyframes.front().panorama = kSamplePanorama;
  }
  for (int i = 0; i < options.points && !map->keyframes.empty(); ++i) {
    MapPoint point;
    point.id = static_cast<engine::MapPointId>(2 * i);
    const Eigen::Vector3d position = RandomVector(random, 2.0);
    const bool infinite = i % 4 == 3;
    point.point_in_map << (infinite ? position.normalized() : position), infinite ? 0.0 : 1.0;
    if (infinite) point.panorama = kSamplePanorama;
    point.was_infinite = i % 8 == 2;
    point.source_keyframe = map->keyframes[random.Below(static_cast<std::uint32_t>(options.keyframes))].id;
    point.source_level = static_cast<std::uint8_t>(random.Below(engine::kPyramidLevels));
    const int scale = 1 << point.source_level;
    point.source_pixel = {static_cast<float>(random.Uniform(0, options.width_px / scale - 1)),
                          static_cast<float>(random.Uniform(0, options.height_px / scale - 1))};
    point.normal = RandomVector(random, 1.0).normalized().cast<float>();
    map->points.push_back(point);
  }
  map->next_point = map->points.empty() ? 0 : map->points.back().id + 1;
  for (const KeyFrame& keyframe : map->keyframes) {
    for (const MapPoint& point : map->points) {
      if (random.Below(3) == 0) continue;
      const Eigen::Vector2f pixel(static_cast<float>(random.Uniform(0, options.width_px - 1)),
                                  static_cast<float>(random.Uniform(0, options.height_px - 1)));
      map->observations.push_back({keyframe.id, point.id, pixel, static_cast<std::uint8_t>(random.Below(4))});
    }
  }
  return map;
}

std::shared_ptr<engine::MapSnapshot> MakeTrueMap(int keyframes, double step) {
  auto map = MakeSampleMap(1, {.keyframes = keyframes, .points = 0, .width_px = 320, .height_px = 240});
  map->panoramas.clear();
  for (std::size_t i = 0; i < map->keyframes.size(); ++i) {
    engine::KeyFrame& keyframe = map->keyframes[i];
    keyframe.kind = engine::KeyFrameKind::kSixDof;
    keyframe.panorama = engine::kNoId;
    keyframe.fixed = i < 2;  // Two fixed keyframes define the scale.
    keyframe.camera = map->keyframes.front().camera;
    const double x = step * static_cast<double>(i);
    keyframe.camera_from_map = {engine::Rotation3::Exp({0.01 * x, -0.1 * x, 0.02}), {-x, 0.02 * x, 0.1 * x}};
  }
  for (std::uint32_t i = 0; i < 300; ++i) {
    engine::MapPoint point;
    point.id = i;
    const double x = -1.2 + 0.15 * (i % 20), y = -0.9 + 0.12 * (i / 20);
    point.point_in_map = {x, y, 3 + 0.4 * std::sin(3 * x) * std::cos(2 * y), 1};
    point.source_keyframe = map->keyframes.front().id;
    map->points.push_back(point);
  }
  map->next_point = 300;
  for (const engine::KeyFrame& keyframe : map->keyframes) {
    for (const engine::MapPoint& point : map->points) {
      const auto pixel = keyframe.camera->Project(keyframe.camera_from_map * point.position());
      if (pixel && keyframe.camera->IsInside(*pixel, 1))
        map->observations.push_back({keyframe.id, point.id, pixel->cast<float>(), 0});
    }
  }
  return map;
}

void AddSampleKeyFrame(std::uint64_t seed, const Eigen::Vector3d& center, MapSnapshot* map) {
  map->keyframes.push_back(MakeKeyFrame(map->next_keyframe++, center, seed, map->keyframes.front().camera));
  ++map->revision;
}

AssetRecord MakeSampleAsset(std::uint64_t seed, std::size_t bytes) {
  Random random(seed);
  Bytes content(bytes);
  for (std::uint8_t& byte : content) byte = static_cast<std::uint8_t>(random.Next());
  return {"asset-" + std::to_string(seed), "model " + std::to_string(seed) + ".glb",
          std::make_shared<const Bytes>(std::move(content))};
}

std::shared_ptr<SceneRecord> MakeSampleScene(std::uint64_t seed, int assets) {
  auto scene = std::make_shared<SceneRecord>();
  scene->text = "{\"scene\": " + std::to_string(seed) + ", \"name\": \"Gr\xC3\xBC\xC3\x9F\"}";
  for (int i = 0; i < assets; ++i)
    scene->assets.push_back(MakeSampleAsset(seed + static_cast<std::uint64_t>(i), 3000));
  return scene;
}

SceneTools SampleSceneTools() {
  SceneTools tools;
  tools.read = [](const SceneRecord& scene, std::vector<std::string>* problems) {
    SceneRecord left;
    std::istringstream lines(scene.text);
    for (std::string line; std::getline(lines, line);) {
      std::string problem = line == "damaged" ? "a line is damaged" : "";
      for (const AssetRecord& asset : scene.assets) {
        if (line == "model " + asset.id) left.assets.push_back(asset);
      }
      const bool found = !left.assets.empty() && line == "model " + left.assets.back().id;
      if (line.starts_with("model ") && !found) problem = "the asset of '" + line + "' is lost";
      if (problem.empty()) {
        left.text += (left.text.empty() ? "" : "\n") + line;
      } else {
        problems->push_back(problem);
      }
    }
    if (problems->empty()) return scene;
    return left;
  };
  tools.retarget = [](const std::string& text, const Retarget& retarget) {
    std::string changed;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line == "damaged") throw Error("the scene is damaged");
      std::istringstream words(line);
      std::string kind, name;
      SignpostTarget target;
      if (words >> kind && kind == "sign" && words >> name >> target.key) {
        std::getline(words >> std::ws, target.map);
        if (const auto now = retarget(name, target))
          line = "sign " + name + " " + std::to_string(now->key) + " " + now->map;
      }
      changed += (changed.empty() ? "" : "\n") + line;
    }
    return changed == text ? std::nullopt : std::optional(changed);
  };
  tools.retarget_history = tools.retarget;
  return tools;
}

std::shared_ptr<SceneRecord> MakeTextScene(std::string text) {
  auto scene = std::make_shared<SceneRecord>();
  scene->text = std::move(text);
  return scene;
}

std::string FirstDifference(const MapSnapshot& a, const MapSnapshot& b) {
  if (a.revision != b.revision) return "revision";
  if (a.next_keyframe != b.next_keyframe || a.next_point != b.next_point) return "next ids";
  if (a.next_panorama != b.next_panorama || a.panoramas.size() != b.panoramas.size()) return "panorama maps";
  for (std::size_t i = 0; i < a.panoramas.size(); ++i) {
    if (a.panoramas[i].id != b.panoramas[i].id || a.panoramas[i].reference != b.panoramas[i].reference)
      return "panorama map at index " + std::to_string(i);
  }
  if (a.keyframes.size() != b.keyframes.size()) return "number of keyframes";
  if (a.points.size() != b.points.size()) return "number of points";
  if (a.observations.size() != b.observations.size()) return "number of observations";
  for (std::size_t i = 0; i < a.keyframes.size(); ++i) {
    if (!Same(a.keyframes[i], b.keyframes[i])) return "keyframe at index " + std::to_string(i);
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    const MapPoint &p = a.points[i], &q = b.points[i];
    if (p.id != q.id || p.point_in_map != q.point_in_map || p.source_keyframe != q.source_keyframe ||
        p.source_level != q.source_level || p.source_pixel != q.source_pixel || p.normal != q.normal ||
        p.panorama != q.panorama || p.was_infinite != q.was_infinite) {
      return "point at index " + std::to_string(i);
    }
  }
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    const engine::Observation &p = a.observations[i], &q = b.observations[i];
    if (p.keyframe != q.keyframe || p.point != q.point || p.pixel != q.pixel || p.level != q.level) {
      return "observation at index " + std::to_string(i);
    }
  }
  return {};
}

std::string FirstDifference(const SceneRecord& a, const SceneRecord& b) {
  if (a.text != b.text) return "text";
  if (a.assets.size() != b.assets.size()) return "number of assets";
  for (std::size_t i = 0; i < a.assets.size(); ++i) {
    if (a.assets[i].id != b.assets[i].id || a.assets[i].name != b.assets[i].name ||
        *a.assets[i].bytes != *b.assets[i].bytes) {
      return "asset " + a.assets[i].id;
    }
  }
  return {};
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "docent-maps-XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::permissions(path_, fs::perms::owner_all, ignored);
  fs::remove_all(path_, ignored);
}

LibraryOptions QuickOptions() {
  LibraryOptions options;
  options.make_features = MakeSizesOnly;
  options.load_threads = 1;
  options.scenes = SampleSceneTools();
  return options;
}

Library OpenToWrite(const fs::path& file) {
  return Library::Open(file, Access::kReadWrite, CreateIfMissing::kYes, QuickOptions());
}

Library OpenToRead(const fs::path& file) {
  return Library::Open(file, Access::kReadOnly, CreateIfMissing::kNo, QuickOptions());
}

Bytes ReadWholeFile(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void WriteWholeFile(const fs::path& path, std::span<const std::uint8_t> bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

void RunSql(const std::filesystem::path& file, const std::string& sql) {
  sqlite3* connection = nullptr;
  char* message = nullptr;
  int result = sqlite3_open(file.c_str(), &connection);
  if (result == SQLITE_OK) result = sqlite3_exec(connection, sql.c_str(), nullptr, nullptr, &message);
  const std::string problem = message ? message : sqlite3_errstr(result);
  sqlite3_free(message);
  sqlite3_close(connection);
  if (result != SQLITE_OK) throw Error(file.string() + ": " + sql + ": " + problem);
}

std::string FilesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  std::string line;
  for (const std::string& name : names) line += (line.empty() ? "" : " ") + name;
  return line;
}

}  // namespace docent::maps
