// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/small_library.h"

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core/mat.hpp>
#include <string>
#include <system_error>

#include "maps/storage/snapshot_reader.h"

namespace docent::fuzz {

namespace fs = std::filesystem;

fs::path TemporaryFolder() {
  // Never destroyed, because the exit handler needs it.
  static const fs::path& folder = *new fs::path([] {
    const char* const memory = "/dev/shm";
    std::error_code error;
    const fs::path base = fs::is_directory(memory, error) ? fs::path(memory) : fs::temp_directory_path();
    fs::path made = base / ("docent-fuzz-" + std::to_string(getpid()));
    fs::create_directories(made);
    std::atexit([] { fs::remove_all(TemporaryFolder()); });
    return made;
  }());
  return folder;
}

std::shared_ptr<const engine::MapSnapshot> SmallMap() {
  const engine::CameraModel::Intrinsics intrinsics{64, 64, 60, 60, 32, 32};
  const auto camera = std::make_shared<const engine::CameraModel>(engine::LensModel::kRadialTangential,
                                                                  intrinsics, std::array<double, 5>{});
  auto map = std::make_shared<engine::MapSnapshot>();
  for (std::uint32_t i = 0; i < 2; ++i) {
    engine::KeyFrame keyframe;
    keyframe.id = i;
    keyframe.camera = camera;
    cv::Mat image(64, 64, CV_8UC1, cv::Scalar(50.0 + i));
    for (int square = 0; square < 9; ++square)
      image(cv::Rect(14 + square % 3 * 14, 14 + square / 3 * 14, 7, 7)) = cv::Scalar(120.0 + 15 * square);
    keyframe.features = maps::MakeSizesOnly(image);
    map->keyframes.push_back(keyframe);
    engine::MapPoint point;
    point.id = i;
    point.point_in_map = {0.1 * i, 0, 1, 1};
    point.source_keyframe = 0;
    map->points.push_back(point);
    map->observations.push_back({0, i, {5, 5}, 0});
  }
  map->next_keyframe = map->next_point = 2;
  return map;
}

std::shared_ptr<const maps::SceneRecord> SmallScene() {
  auto scene = std::make_shared<maps::SceneRecord>();
  scene->text = "{}";
  scene->assets.push_back({"asset", "model.glb", std::make_shared<const maps::Bytes>(maps::Bytes(20, 7))});
  return scene;
}

}  // namespace docent::fuzz
