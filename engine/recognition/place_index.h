// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "engine/recognition/inverted_file.h"
#include "engine/recognition/keyframe_words.h"
#include "engine/recognition/place.h"
#include "engine/recognition/thumbnail_array.h"

namespace docent::engine {

// Finds the keyframes of all maps whose appearance is similar to an image (ptamm §3.2, §3.3). It combines
// two methods: small blurry images, of which all are compared (thumbnail_array.h), and visual words, of which
// only the keyframes that share some are read (inverted_file.h). It stores only this appearance, so that all
// maps of a large library can be searched while only few are in memory. The owner calls SetMap with the
// newest snapshot when a map is loaded or extended, and ReleaseMap when it is evicted.
//
// All functions are thread-safe. A search reads one immutable state of the index; writers replace the whole
// state and do not wait for searches. Only the words are changed in place, under a lock that is held for
// microseconds.
//
// Memory per keyframe: 1.3 kB for the thumbnail in two sizes and about 1.4 kB for the words.
class PlaceIndex : public PlaceFinder {
 public:
  PlaceIndex();
  ~PlaceIndex() override;

  // Computes the words of those keyframes of a map that the index does not have yet, in one to two
  // milliseconds per keyframe. Call it before taking a lock under which SetMap is called.
  std::vector<KeyFrameWords> DescribeNew(std::uint64_t key, const MapSnapshot& map) const;
  // Adds or updates a map. Appearance that the index already has is not stored again. `described` is the
  // result of DescribeNew or a part of it; missing words are computed now if it is empty. key > 0.
  void SetMap(std::uint64_t key, std::shared_ptr<const MapSnapshot> map,
              const std::vector<KeyFrameWords>& described = {});
  // Adds a map that is not in memory, so that its candidates have no snapshot. Both lists are ordered by
  // ascending keyframe. Words of keyframes without a thumbnail are ignored; keyframes without words get them
  // once their map is in memory.
  void SetAppearance(std::uint64_t key, std::span<const KeyFrameThumbnail> thumbnails,
                     std::span<const KeyFrameWords> words = {});
  // Releases a map's snapshot but keeps its appearance.
  void ReleaseMap(std::uint64_t key);
  // Forgets a map; does nothing if there is none with that key.
  void RemoveMap(std::uint64_t key);
  // Reserves memory for this many thumbnails of images with an aspect ratio of 4:3, so that loading a library
  // allocates once.
  void Reserve(std::size_t keyframes);

  std::size_t maps() const;                                // The number of maps.
  std::size_t keyframes() const;                           // The number of keyframes of all maps.
  std::size_t words() const { return words_.postings(); }  // The number of words in all keyframes.

  // Retrieves the best keyframes by each method, then compares all of them by both methods and ranks them by
  // the sum (see PlaceSimilarity in place_ranking.h). Keyframes that are close together are one place; the
  // first five results are five different places if the query asks for that. Without words in the query, only
  // thumbnails are used. Keyframes whose thumbnails have another size than the query's are found by words
  // alone. PlaceCandidate::map is null for maps that are not in memory.
  std::vector<PlaceCandidate> FindPlaces(const PlaceQuery& query, int count, int per_map,
                                         std::uint64_t only_map) const override;

 private:
  struct Entry;
  struct Map;
  struct State;
  class Update;
  class Merge;
  // The new data of a keyframe when its map is set. Null fields keep what the index has.
  struct KeyFrameUpdate {
    KeyFrameId keyframe = kNoId, place = kNoId;
    const void* source = nullptr;  // See Entry.
    const PackedThumbnail* thumbnail = nullptr;
    const WordBag* words = nullptr;
  };
  std::shared_ptr<const State> Current() const;
  void Publish(std::shared_ptr<const State> state);
  void Replace(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot,
               std::span<const KeyFrameUpdate> updates);
  void RemoveWords(const Map* before, std::vector<InvertedFile::Slot> kept);

  InvertedFile words_;
  std::mutex write_mutex_;              // Serializes writers.
  mutable std::mutex state_mutex_;      // Held while a pointer is copied.
  std::shared_ptr<const State> state_;  // Never null.
};

}  // namespace docent::engine
