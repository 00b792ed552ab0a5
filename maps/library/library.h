// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/dense/densification.h"
#include "engine/recognition/thumbnail_array.h"
#include "maps/index/word_rows.h"
#include "maps/storage/map_record.h"
#include "maps/storage/policy.h"
#include "maps/storage/scene_tools.h"
#include "maps/storage/tour_rows.h"

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

inline constexpr std::size_t kMaxMapNameBytes = 200;  // Longest name of a map, as UTF-8.
// Why a map cannot have this name, as a sentence without capital and full stop; empty if it can.
std::string ValidateMapName(const std::string& name);

// Whether a library may be changed through this object. Several processes may open one library.
enum class Access { kReadOnly, kReadWrite };
// Whether a library that does not exist is created.
enum class CreateIfMissing { kNo, kYes };

// Computes the features that the engine needs from a keyframe's stored image (CV_8UC1). Called concurrently
// from several threads.
using FeatureMaker = std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat& gray)>;

// What a library is opened with.
struct LibraryOptions {
  std::function<WallTime()> clock;  // For the creation and modification times; the system clock if empty.
  FeatureMaker make_features;       // engine::MakeFeatures if empty.
  int load_threads = 0;             // Threads that decode images; 0 means one per processor, at most 8.
  SceneTools scenes;                // Without them, scenes are neither checked nor redirected.
};

// An open library; see the top of this file for its guarantees.
class Library {
 public:
  // Opens a library, and upgrades one of an older format that is opened for writing. Throws docent::Error
  // when there is none and none is to be created, it is no library, or it is newer than this program.
  static Library Open(const std::filesystem::path& path, Access access,
                      CreateIfMissing create = CreateIfMissing::kNo, LibraryOptions options = {});
  Library(Library&&) noexcept;  // The other one may only be destroyed afterwards.
  Library& operator=(Library&&) = delete;
  ~Library();

  Access access() const;            // As it was opened.
  const std::string& file() const;  // The path that was passed to Open.

  // Returns all maps by ascending key, without reading points or images.
  std::vector<MapInfo> List() const;
  MapInfo Find(std::uint64_t key) const;              // Throws if there is no such map.
  MapInfo FindByName(const std::string& name) const;  // Throws if there is no such map.
  // What Load does with content that is damaged.
  enum class DamagedContent { kRefuse, kLeaveOut };
  // Reads a map with points and images and computes the features of its keyframes. Throws if there is no such
  // map or it is damaged; damaged content may be left out instead.
  StoredMap Load(std::uint64_t key, DamagedContent damaged = DamagedContent::kRefuse) const;
  // Reads the content of a map only. Throws as Load does; if `lost_content` is given, damaged content is left
  // out and described there instead.
  SceneRecord LoadScene(std::uint64_t key, std::vector<std::string>* lost_content = nullptr) const;
  // Reads the changes of a map's scene that can be undone, with their assets; empty if there are none for the
  // scene as it is. Throws when they are damaged, which nothing else depends on.
  std::optional<SceneRecord> LoadHistory(std::uint64_t key) const;
  // Reads the mesh of a map's surfaces; empty if it has none. Throws when it is damaged, which nothing else
  // depends on. engine::StateOf says whether the map has changed since.
  std::optional<engine::MapMesh> LoadMesh(std::uint64_t key) const;
  // The appearance of a map, which a place index needs. It has a few kilobytes per keyframe and is read
  // without points or images. For a damaged table the list is empty and `problem` describes the error.
  struct Appearance {
    std::vector<engine::KeyFrameThumbnail> thumbnails;  // By ascending keyframe.
    std::vector<engine::KeyFrameWords> words;           // Also empty when no words are stored; see ReadWords.
    std::string problem;                                // One sentence; empty if there is none.
  };
  // Takes the appearance of one map.
  using TakeAppearance = std::function<void(const MapInfo& info, Appearance appearance)>;
  // Passes the appearance of every map to `take`, by ascending key.
  void LoadAppearance(const TakeAppearance& take) const;

  // The estimated lenses that were saved (MapRecord::lenses), by ascending camera name. Throws Error if one
  // is damaged.
  std::vector<StoredLens> Lenses() const;

  // The tours, by ascending name. Throws Error if one is damaged; if `problems` is given, damaged tours are
  // left out and described there instead.
  std::vector<Tour> Tours(std::vector<std::string>* problems = nullptr) const;
  // Changes the tours in one transaction: `change` gets the readable ones and adds, changes or removes some,
  // or throws. Throws Error, and writes nothing, if a tour is invalid then, a name is used twice, or a stop
  // is no map of this library.
  void ChangeTours(const std::function<void(std::vector<Tour>* tours)>& change);

  // Returns a key that no map of this library has or ever had. It is reserved on disk, so that two processes
  // never get the same one.
  std::uint64_t NewKey() { return ReserveKeys(1); }
  // The same for `count` consecutive keys; returns the first.
  std::uint64_t ReserveKeys(std::size_t count);
  // Adds or updates a map; see MapRecord and the table in policy.h. Unchanged parts, such as the images of
  // stored keyframes, are not rewritten. Maps that were joined into this one (MapRecord::joined_keys) are
  // removed in the same transaction. Returns false, and writes nothing, when the stored map is not the one
  // that MapRecord::expected_revision, expected or expected_scene names.
  bool Save(const MapRecord& record);
  // Stores the mesh of a map's surfaces. It is computed from the rest of the map, so that no policy forbids
  // it and the map does not count as changed. A save that moves or removes a keyframe of the mesh removes it.
  // Returns false, and writes nothing, when the map does not exist any more or the mesh does not belong to it
  // as it is stored. Throws when the mesh is too large (see mesh_rows.h).
  bool SaveMesh(std::uint64_t key, const engine::MapMesh& mesh);
  // Signposts keep leading to the map. Throws if there is no such map, its policy forbids it, or another map
  // has the name.
  void Rename(std::uint64_t key, const std::string& name);
  // Removes a map with its content. Signposts in other maps that lead to it lead nowhere afterwards, and
  // tours no longer stop at it. Throws
  // if there is no such map, its policy forbids it, or that of a map with such a signpost does.
  void Remove(std::uint64_t key);
  // The only way to relax a policy. Setting `bounded` computes the bounds from the map's contents, unless it
  // was bounded before and has not been open since.
  void SetPolicy(std::uint64_t key, Policy policy);

  // Executes a join in one transaction: `into` gets the snapshot, the scene and the stricter policy,
  // signposts in other maps are redirected, tours stop at `into` instead, and `from` is removed. The policies
  // of both maps must allow changes to keyframes and points, and those of the maps whose scenes are
  // redirected must allow changes to content. Returns false, and writes nothing, when one of the two maps has
  // changed since it was loaded.
  bool Join(const JoinRecord& record);

  // Reads and validates everything. Returns one sentence for each error; empty if there is none.
  std::vector<std::string> Verify() const;
  // One sentence for each signpost that leads to a map that does not exist.
  std::vector<std::string> SignpostsToNoMap() const;
  // A signpost in a map.
  struct Signpost {
    MapInfo map;               // The map that it stands in.
    std::string name;          // Unique in that map.
    std::uint64_t to_key = 0;  // Of the map that it leads to.
  };
  // All signposts that lead to a map of this library.
  std::vector<Signpost> Signposts() const;
  // The signposts in other maps that lead to this one.
  std::vector<Signpost> SignpostsTo(std::uint64_t key) const;

 private:
  class Impl;
  explicit Library(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::maps
