// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "engine/map/map_snapshot.h"
#include "maps/library.h"
#include "maps/map_record.h"

// Maps made of numbers under a seed, and folders that clean up after themselves, for the tests of the
// library.
namespace docent::maps {

struct SampleOptions {
  int keyframes = 3;
  int points = 40;
  int width_px = 96, height_px = 80;
  bool corners = false;  // images of blocks, which have words, instead of noise, which has none
};

// Keyframes along a path with images of noise over a gradient, two cameras, finite and infinite points,
// each seen from some keyframes. Valid, and different for each seed.
std::shared_ptr<engine::MapSnapshot> MakeSampleMap(std::uint64_t seed, const SampleOptions& options = {});
// A map as the engine makes them: points on a wavy wall, seen where they are, by keyframes in a row that are
// `step` apart.
std::shared_ptr<engine::MapSnapshot> MakeTrueMap(int keyframes = 6, double step = 0.2);
// One more keyframe at `center`, with the image of `seed`.
void AddSampleKeyFrame(std::uint64_t seed, const Eigen::Vector3d& center, engine::MapSnapshot* map);

AssetRecord MakeSampleAsset(std::uint64_t seed, std::size_t bytes);
std::shared_ptr<SceneRecord> MakeSampleScene(std::uint64_t seed, int assets);

// Empty when they are equal field by field and pixel by pixel, else the first difference.
std::string FirstDifference(const engine::MapSnapshot& a, const engine::MapSnapshot& b);
std::string FirstDifference(const SceneRecord& a, const SceneRecord& b);

// A folder that is gone when the test is over.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Features of the right sizes without corners: quick, for tests that look at what is stored.
LibraryOptions QuickOptions();
// With these options. To be written, a library is made where there is none.
Library OpenToWrite(const std::filesystem::path& file);
Library OpenToRead(const std::filesystem::path& file);

Bytes ReadWholeFile(const std::filesystem::path& path);
void WriteWholeFile(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
// Changes a library behind its back. Throws docent::Error with what SQLite has against it.
void RunSql(const std::filesystem::path& file, const std::string& sql);
// The names in a folder, sorted, separated by spaces.
std::string FilesIn(const std::filesystem::path& folder);
// The sentence of the docent::Error that `body` throws; "no error" when it throws none.
std::string ErrorOf(const std::function<void()>& body);

}  // namespace docent::maps
