// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "engine/recognition/place.h"
#include "maps/inverted_file.h"
#include "maps/thumbnail_array.h"
#include "maps/word_rows.h"

namespace docent::maps {

// Which keyframes, of all maps, look like an image (ptamm §3.2, §3.3), in two ways: by small blurry images,
// all of which are compared (thumbnail_array.h), and by the words of their descriptors, of which only those
// are touched that share some (inverted_file.h). A map is known by these alone, so that all maps of a large
// library can be searched while only few of them are in memory; whoever loads or extends a map hands its
// newest snapshot to SetMap, whoever lets one go calls ReleaseMap.
//
// Any thread may call anything: a search reads one immutable state of the index, which writers replace whole
// and never wait for; the words alone are changed in place, under a lock that is held for microseconds.
//
// What a keyframe costs: 1.3 kB for its thumbnail in two sizes, about 1.4 kB for its words.
class PlaceIndex : public engine::PlaceFinder {
 public:
  PlaceIndex();
  ~PlaceIndex() override;

  // The words of a map's keyframes that the index does not know yet. Takes a millisecond or two a keyframe:
  // for whoever hands a map to SetMap under a lock, to be called before.
  std::vector<KeyFrameWords> DescribeNew(std::uint64_t key, const engine::MapSnapshot& map) const;
  // Adds a map or brings it up to date. What of its keyframes the index has already is not stored again.
  // described: what DescribeNew said of them, or of some; the rest is described now. key > 0.
  void SetMap(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> map,
              const std::vector<KeyFrameWords>& described = {});
  // Adds a map that is not in memory: candidates in it have no snapshot. Both by ascending keyframe; words of
  // keyframes without a thumbnail are passed over, and those of which no words are told are described once
  // their map is in memory.
  void SetAppearance(std::uint64_t key, std::span<const KeyFrameThumbnail> thumbnails,
                     std::span<const KeyFrameWords> words = {});
  // Keeps a map's looks and lets its snapshot go.
  void ReleaseMap(std::uint64_t key);
  void RemoveMap(std::uint64_t key);
  // Makes room for this many thumbnails of images with sides as 4 to 3, so that a library is read in one
  // go.
  void Reserve(std::size_t keyframes);

  std::size_t maps() const;
  std::size_t keyframes() const;
  std::size_t words() const { return words_.postings(); }  // of all keyframes

  // Each way brings its best; all of these are then compared in both and ranked by the sum (see Likeness in
  // place_ranking.h). Keyframes near each other are one place: five different places come first. Without
  // words in the query thumbnails alone decide. PlaceCandidate::map is null where the map is not in memory.
  // Keyframes with thumbnails of another size than the query's are found by words alone.
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override;

 private:
  struct Entry;
  struct Map;
  struct State;
  class Update;
  class Merge;
  // What is told of a keyframe when its map is set. Null: it is as the index knows it.
  struct News {
    engine::KeyFrameId keyframe = engine::kNoId, place = engine::kNoId;
    const void* source = nullptr;  // see Entry
    const PackedThumbnail* thumbnail = nullptr;
    const engine::WordBag* words = nullptr;
  };
  std::shared_ptr<const State> Current() const;
  void Publish(std::shared_ptr<const State> state);
  void Replace(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot,
               std::span<const News> news);
  void RemoveWords(const Map* before, std::vector<InvertedFile::Slot> kept);

  InvertedFile words_;
  std::mutex write_mutex_;              // one writer at a time
  mutable std::mutex state_mutex_;      // held while a pointer is copied
  std::shared_ptr<const State> state_;  // never null
};

}  // namespace docent::maps
