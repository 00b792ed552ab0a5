// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "maps/map_record.h"
#include "maps/policy.h"
#include "maps/thumbnail_array.h"
#include "maps/word_rows.h"

// A library of maps: one SQLite file, NAME.docent (maps/README.md describes it).
//
// What holds: each save is one transaction, on disk when the call returns; a process that is killed at any
// moment loses at most the save that it was in. What is read was checked, value by value. Policies are
// enforced here, whoever calls. A library opened read only changes nothing, and sees what an author in
// another process saves meanwhile. Faults throw docent::Error: one sentence that begins with the file's name.
//
// Any thread may call any function; calls wait for each other, and a large save takes a while, so that
// threads with a frame to draw leave saving to maps::Saver.
namespace docent::maps {

inline constexpr std::size_t kMaxMapNameBytes = 200;

enum class Access { kReadOnly, kReadWrite };
enum class CreateIfMissing { kNo, kYes };

// Makes of a stored image (CV_8UC1) what an engine needs of a keyframe. Called from several threads at
// once.
using FeatureMaker = std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat& gray)>;

struct LibraryOptions {
  std::function<WallTime()> clock;  // for created and modified; the system's when empty
  FeatureMaker make_features;       // engine::MakeFeatures when empty
  int load_threads = 0;             // that decode images; 0: one a processor, at most 8
};

class Library {
 public:
  static Library Open(const std::filesystem::path& path, Access access,
                      CreateIfMissing create = CreateIfMissing::kNo, LibraryOptions options = {});
  Library(Library&&) noexcept;
  Library& operator=(Library&&) = delete;
  ~Library();

  Access access() const;
  const std::string& file() const;  // as it was named to Open

  // All maps by ascending key. Reads no points and no images.
  std::vector<MapInfo> List() const;
  MapInfo Find(std::uint64_t key) const;              // throws when there is none
  MapInfo FindByName(const std::string& name) const;  // throws when there is none
  StoredMap Load(std::uint64_t key) const;
  SceneRecord LoadScene(std::uint64_t key) const;
  // Hands out what a place index needs of every map, by ascending key: a few kilobytes a keyframe, without
  // touching points or images. What is damaged is told as an empty list and a sentence.
  struct Appearance {
    std::vector<KeyFrameThumbnail> thumbnails;
    std::vector<KeyFrameWords> words;  // empty also where none are known, see ReadWords
    std::string problem;
  };
  using TakeLooks = std::function<void(const MapInfo& info, Appearance appearance)>;
  void LoadAppearance(const TakeLooks& take) const;

  // A key that no map of this library has or ever had; reserved on disk, so that two processes never share
  // one.
  std::uint64_t NewKey();
  // Adds a map or brings it up to date; see MapRecord and the table in policy.h. What is unchanged costs
  // nothing on disk: images of keyframes that are stored already are kept as they are. Maps that it holds
  // now (MapRecord::holds) are removed in the same transaction. False, and nothing was written, when the
  // stored revision is not the one that the record wants.
  bool Save(const MapRecord& record);
  void Rename(std::uint64_t key, const std::string& name);
  void Remove(std::uint64_t key);
  // The only way to loosen a policy. `bounded` fixes the bounds from what the map holds, unless it was
  // bounded before and not opened since.
  void SetPolicy(std::uint64_t key, Policy policy);

  // Carries out in one transaction what joins two maps: `into` gets snapshot, scene and the stricter policy,
  // the scenes of the other maps are redirected, and `from` is removed. Both policies must allow that
  // keyframes and points change, and those of maps whose scenes are redirected that their content does.
  // False, and nothing was written, when one of the two is no more as it was loaded.
  bool Join(const JoinRecord& record);

  // Reads everything and says what is wrong, a sentence each; empty when all is well.
  std::vector<std::string> Verify() const;

 private:
  class Impl;
  explicit Library(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::maps
