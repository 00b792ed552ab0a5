// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "engine/recognition/thumbnail_array.h"
#include "maps/map_record.h"
#include "maps/policy.h"
#include "maps/word_rows.h"

// A library of maps: one SQLite file, NAME.docent, which maps/README.md describes.
//
// Guarantees: each save is one transaction that is on disk when the call returns, so a process that is killed
// loses at most the current save. Every value that is read is validated. The library enforces the policies
// for all callers. A library that was opened read-only is never modified, and it shows what another process
// saves in the meantime. Errors throw docent::Error with a one-sentence message that begins with the file's
// name.
//
// All functions are thread-safe and are executed one at a time. A large save takes long, so real-time threads
// use maps::Saver instead.
namespace docent::maps {

inline constexpr std::size_t kMaxMapNameBytes = 200;

enum class Access { kReadOnly, kReadWrite };
enum class CreateIfMissing { kNo, kYes };

// Computes the features that the engine needs from a keyframe's stored image (CV_8UC1). Called concurrently
// from several threads.
using FeatureMaker = std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat& gray)>;

struct LibraryOptions {
  std::function<WallTime()> clock;  // For the creation and modification times; the system clock if empty.
  FeatureMaker make_features;       // engine::MakeFeatures if empty.
  int load_threads = 0;             // Threads that decode images; 0 means one per processor, at most 8.
};

class Library {
 public:
  static Library Open(const std::filesystem::path& path, Access access,
                      CreateIfMissing create = CreateIfMissing::kNo, LibraryOptions options = {});
  Library(Library&&) noexcept;
  Library& operator=(Library&&) = delete;
  ~Library();

  Access access() const;
  const std::string& file() const;  // The path that was passed to Open.

  // Returns all maps by ascending key, without reading points or images.
  std::vector<MapInfo> List() const;
  MapInfo Find(std::uint64_t key) const;              // Throws if there is no such map.
  MapInfo FindByName(const std::string& name) const;  // Throws if there is no such map.
  StoredMap Load(std::uint64_t key) const;
  SceneRecord LoadScene(std::uint64_t key) const;
  // Passes the appearance of every map, which a place index needs, to `take` by ascending key. It has a few
  // kilobytes per keyframe and is read without points or images. For a damaged table the list is empty and
  // `problem` describes the error.
  struct Appearance {
    std::vector<engine::KeyFrameThumbnail> thumbnails;
    std::vector<engine::KeyFrameWords> words;  // Also empty when no words are stored; see ReadWords.
    std::string problem;
  };
  using TakeAppearance = std::function<void(const MapInfo& info, Appearance appearance)>;
  void LoadAppearance(const TakeAppearance& take) const;

  // The estimated lenses that were saved (MapRecord::lenses), by ascending camera name. Throws Error if one
  // is damaged.
  std::vector<StoredLens> Lenses() const;

  // Returns a key that no map of this library has or ever had. It is reserved on disk, so that two processes
  // never get the same one.
  std::uint64_t NewKey() { return ReserveKeys(1); }
  // The same for `count` consecutive keys; returns the first.
  std::uint64_t ReserveKeys(std::size_t count);
  // Adds or updates a map; see MapRecord and the table in policy.h. Unchanged parts, such as the images of
  // stored keyframes, are not rewritten. Maps that were joined into this one (MapRecord::joined_keys) are
  // removed in the same transaction. Returns false, and writes nothing, when the stored revision is not
  // MapRecord::expected_revision.
  bool Save(const MapRecord& record);
  void Rename(std::uint64_t key, const std::string& name);
  void Remove(std::uint64_t key);
  // The only way to relax a policy. Setting `bounded` computes the bounds from the map's contents, unless it
  // was bounded before and has not been open since.
  void SetPolicy(std::uint64_t key, Policy policy);

  // Executes a join in one transaction: `into` gets the snapshot, the scene and the stricter policy,
  // signposts in other maps are redirected, and `from` is removed. The policies of both maps must allow
  // changes to keyframes and points, and those of the maps whose scenes are redirected must allow changes to
  // content. Returns false, and writes nothing, when one of the two maps has changed since it was loaded.
  bool Join(const JoinRecord& record);

  // Reads and validates everything. Returns one sentence for each error; empty if there is none.
  std::vector<std::string> Verify() const;

 private:
  class Impl;
  explicit Library(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::maps
