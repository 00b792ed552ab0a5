// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/vocabulary_tree.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// Matches descriptors of an image with the observations of a map, without a pose prior. The observations'
// descriptors are stored in the leaves of a vocabulary tree (hybrid-slam §5.4). The mapper owns one database
// for observations of finite points and one for those of infinite points, and updates them with the map;
// adding and removing cost the same whatever the map size. Const members may be called from any thread while
// no thread modifies the database. Results depend on the entries alone, not on the order of insertion.
class DescriptorDatabase {
 public:
  struct Entry {
    Descriptor descriptor;
    KeyFrameId keyframe = kNoId;
    MapPointId point = kNoId;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
    std::uint8_t level = 0;                           // of the description
    bool operator==(const Entry&) const = default;
  };

  // The tree must outlive the database.
  explicit DescriptorDatabase(const VocabularyTree& tree) : tree_(&tree), leaves_(VocabularyTree::kLeaves) {}

  // An observation may have several entries, one per level and direction.
  void Add(const Entry& entry);
  // Removes all entries of a keyframe.
  void RemoveKeyFrame(KeyFrameId keyframe);
  // Removes the entries of one point in one keyframe. Linear in the keyframe's number of entries.
  void RemoveObservation(KeyFrameId keyframe, MapPointId point);
  void Clear();

  std::size_t size() const { return size_; }
  bool Contains(KeyFrameId keyframe) const { return keyframes_.contains(keyframe); }
  // In no particular order.
  std::vector<Entry> EntriesOf(KeyFrameId keyframe) const;

  struct MatchOptions {
    std::size_t leaves = 4;    // leaves searched per descriptor, up to VocabularyTree::kMaxNearestLeaves
    int max_distance = 60000;  // squared, see kDescriptorLength
    // Largest ratio of the squared distances of the best entry and of the best entry of another point; 0.8
    // squared (Lowe 2004).
    double max_ratio = 0.64;
    bool mutual = true;  // the entry has no closer descriptor among the queries
    // Applies the ratio test within each keyframe separately: for infinite points, two of which may be the
    // same scene point observed in two keyframes.
    bool each_keyframe = false;
    KeyFrameId only_keyframe = kNoId, except_keyframe = kNoId;  // kNoId: no restriction

    // Describes the first invalid option in one sentence, or empty.
    std::optional<std::string> Validate() const;
  };
  struct Match {
    std::size_t query = 0;  // index of the descriptor
    Entry entry;
    int distance = 0;  // squared
  };
  // By query, then keyframe; at most one match per point (per point and keyframe with each_keyframe).
  std::vector<Match> FindMatches(std::span<const Descriptor> queries, const MatchOptions& options) const;

  // Whether both have the same entries, in any order.
  bool operator==(const DescriptorDatabase& other) const;

 private:
  // Position of an entry of a keyframe.
  struct Place {
    std::uint32_t leaf = 0, slot = 0;
  };
  struct Stored {
    KeyFrameId keyframe = kNoId;
    MapPointId point = kNoId;
    Eigen::Vector2f pixel;
    std::uint8_t level = 0;
    std::uint32_t place = 0;  // index in the keyframe's list of positions
  };
  struct Leaf {
    // Separate, because a query reads all of them and few of the other data.
    std::vector<Descriptor> descriptors;
    std::vector<Stored> stored;
  };
  struct Best;
  Entry EntryAt(std::uint32_t leaf, std::uint32_t slot) const;
  void RemovePlace(std::vector<Place>* places, std::size_t index);
  void SearchLeaves(const Descriptor& query, const MatchOptions& options,
                    std::unordered_map<KeyFrameId, Best>* best) const;

  const VocabularyTree* tree_;
  std::vector<Leaf> leaves_;
  std::unordered_map<KeyFrameId, std::vector<Place>> keyframes_;  // without empty lists
  std::size_t size_ = 0;
};

// Adds the descriptors of an observation, computed in its keyframe's image: on its level and on up to
// `levels_around` coarser and finer levels on which the patch fits, so that it is recognized from different
// distances too.
void AddObservation(const ImageFeatures& features, const Observation& observation, int levels_around,
                    DescriptorDatabase* database);

}  // namespace docent::engine
