// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "engine/map/map_snapshot.h"
#include "maps/library/library.h"
#include "maps/storage/map_record.h"
#include "maps/storage/scene_tools.h"
#include "tests/support/error_of.h"

// Random maps with a seed, and temporary folders, for the tests of the library.
namespace docent::maps {

struct SampleOptions {
  int keyframes = 3;
  int points = 40;
  int width_px = 96, height_px = 80;
  bool corners = false;  // Images of blocks, which have words, instead of noise, which has none.
};

// Keyframes along a path with noise images over a gradient, two cameras, and finite and infinite points, each
// observed by some keyframes. The map is valid and different for each seed.
std::shared_ptr<engine::MapSnapshot> MakeSampleMap(std::uint64_t seed, const SampleOptions& options = {});
// A geometrically consistent map: points on a wavy wall with exact observations, and keyframes in a row that
// are `step` apart.
std::shared_ptr<engine::MapSnapshot> MakeTrueMap(int keyframes = 6, double step = 0.2);
// Adds a keyframe at `center` with the image of `seed`.
void AddSampleKeyFrame(std::uint64_t seed, const Eigen::Vector3d& center, engine::MapSnapshot* map);

AssetRecord MakeSampleAsset(std::uint64_t seed, std::size_t bytes);
std::shared_ptr<SceneRecord> MakeSampleScene(std::uint64_t seed, int assets);

// Functions for scenes with one entity per line: "sign NAME KEY MAP" is a signpost, "model ID" needs an
// asset, and "damaged" is not readable; other lines are left as they are. Histories have the same form.
SceneTools SampleSceneTools();
std::shared_ptr<SceneRecord> MakeTextScene(std::string text);

// Returns the first difference, or an empty text when both are equal field by field and pixel by pixel.
std::string FirstDifference(const engine::MapSnapshot& a, const engine::MapSnapshot& b);
std::string FirstDifference(const SceneRecord& a, const SceneRecord& b);

// A temporary folder that its destructor removes.
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

// Options with features of the right sizes without corners, and SampleSceneTools: fast, for tests of the
// stored data.
LibraryOptions QuickOptions();
// Open with these options. OpenToWrite creates a missing library.
Library OpenToWrite(const std::filesystem::path& file);
Library OpenToRead(const std::filesystem::path& file);

Bytes ReadWholeFile(const std::filesystem::path& path);
void WriteWholeFile(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
// Changes a library directly in the file. Throws docent::Error with SQLite's message.
void RunSql(const std::filesystem::path& file, const std::string& sql);
// The names in a folder, sorted and separated by spaces.
std::string FilesIn(const std::filesystem::path& folder);

}  // namespace docent::maps
