// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>

#include "engine/base/random.h"
#include "engine/recognition/place_index.h"
#include "engine/vision/features.h"
#include "maps/library/library.h"
#include "maps/storage/database.h"
#include "tests/bench/library_size.h"

// Opens a library of many maps for a tour: reads its entries, thumbnails and words and builds the place
// index; the maps stay on disk. Each map has 150 or 25 keyframes with small images, but with thumbnails of
// the usual size and 190 words each, as an image of 640 x 480 has. The library is first written to the folder
// for temporary files, 0.8 GB for 1000 maps.
namespace docent::bench {
namespace {

std::shared_ptr<const engine::MapSnapshot> MakeMap(int number, std::size_t keyframes) {
  constexpr int kWidth = 80, kHeight = 64;
  auto map = std::make_shared<engine::MapSnapshot>();
  const engine::CameraModel::Intrinsics intrinsics{kWidth, kHeight, 70, 70, 40, 32};
  const auto camera = std::make_shared<const engine::CameraModel>(engine::LensModel::kRadialTangential,
                                                                  intrinsics, std::array<double, 5>{});
  for (std::size_t i = 0; i < keyframes; ++i) {
    cv::Mat gray(kHeight, kWidth, CV_8UC1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        gray.at<std::uint8_t>(y, x) =
            static_cast<std::uint8_t>(128 + 100 * std::sin(0.01 * (number + 1) * x) *
                                                std::cos(0.05 * static_cast<double>(i + 1) + 0.1 * y));
    }
    auto features = std::make_shared<engine::ImageFeatures>();
    features->levels[0] = gray;
    for (std::size_t level = 1; level < features->levels.size(); ++level)
      features->levels[level] = cv::Mat(kHeight >> level, kWidth >> level, CV_8UC1);
    engine::KeyFrame keyframe;
    keyframe.id = map->next_keyframe++;
    keyframe.camera = camera;
    keyframe.features = features;
    map->keyframes.push_back(keyframe);
  }
  return map;
}

std::vector<engine::KeyFrameWords> MakeWords(int number, std::size_t keyframes) {
  Random random(static_cast<std::uint64_t>(number));
  std::vector<engine::KeyFrameWords> words;
  for (engine::KeyFrameId i = 0; i < keyframes; ++i) {
    std::vector<std::uint32_t> leaves(200);
    for (std::uint32_t& leaf : leaves) leaf = random.Below(engine::VocabularyTree::kLeaves);
    words.push_back({i, i / 5 * 5, engine::MakeWordBag(std::move(leaves))});
  }
  return words;
}

void OpenLibrary(benchmark::State& state) {
  const auto keyframes_a_map = static_cast<std::size_t>(state.range(1));
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("docent-bench-" + std::to_string(getpid()) + ".docent");
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (int i = 0; i < state.range(0); ++i)
      library.Save({library.NewKey(), "map " + std::to_string(i), maps::Policy::kOpen,
                    MakeMap(i, keyframes_a_map), nullptr});
    const maps::Database database = maps::Database::OpenReadWrite(path, false);
    maps::Transaction transaction(database, maps::Transaction::Kind::kWrite);
    for (int i = 0; i < state.range(0); ++i)
      maps::WriteWords(database, static_cast<std::uint64_t>(i) + 1, MakeWords(i, keyframes_a_map));
    transaction.Commit();
  }
  std::size_t keyframes = 0, words = 0;
  for (auto _ : state) {
    const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
    engine::PlaceIndex index;
    std::size_t wanted = 0;
    for (const maps::MapInfo& info : library.List()) wanted += info.keyframes;
    index.Reserve(wanted);
    library.LoadAppearance([&](const maps::MapInfo& info, const maps::Library::Appearance& appearance) {
      index.SetAppearance(info.key, appearance.thumbnails, appearance.words);
    });
    words = index.words();
    keyframes = index.keyframes();
  }
  state.counters["keyframes"] = static_cast<double>(keyframes);
  state.counters["words_a_keyframe"] = static_cast<double>(words) / static_cast<double>(keyframes);
  state.counters["file_mb"] = static_cast<double>(std::filesystem::file_size(path)) * 1e-6;
  std::filesystem::remove(path);
}
BENCHMARK(OpenLibrary)
    ->ArgNames({"maps", "keyframes_a_map"})
    ->ArgsProduct({{30, 1000}, {kKeyFramesOfAMap}})
    // Museums of small exhibits, up to 15 GB.
    ->ArgsProduct({{1'000, 10'000, 100'000}, {25}})
    // Smaller ones; 3.3 GB, written in a quarter of an hour.
    ->ArgsProduct({{100'000}, {5}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace docent::bench
