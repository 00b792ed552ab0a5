// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/vocabulary_tree.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// Finds which observations of a map look like those of an image, without knowing where the image was
// taken: the descriptors of observations in the leaves of a vocabulary tree (hybrid-slam §5.4). The mapper
// owns one for observations of finite points and one for those of infinite points, and keeps them in step
// with the map; adding and removing cost the same however large the map is. Const members may be called from
// any thread while nobody changes it. Answers depend on the entries alone, not on the order of their coming.
class DescriptorDatabase {
 public:
  struct Entry {
    Descriptor descriptor;
    KeyFrameId keyframe = kNoId;
    MapPointId point = kNoId;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
    std::uint8_t level = 0;                           // that it was described on
    bool operator==(const Entry&) const = default;
  };

  // The tree must outlive the database.
  explicit DescriptorDatabase(const VocabularyTree& tree) : tree_(&tree), leaves_(VocabularyTree::kLeaves) {}

  // An observation may have several entries, one a level and direction.
  void Add(const Entry& entry);
  // All of a keyframe's entries.
  void RemoveKeyFrame(KeyFrameId keyframe);
  // Those of one point in one keyframe. In the time of looking through that keyframe's entries.
  void RemoveObservation(KeyFrameId keyframe, MapPointId point);
  void Clear();

  std::size_t size() const { return size_; }
  std::size_t KeyFrameCount() const { return keyframes_.size(); }
  bool Contains(KeyFrameId keyframe) const { return keyframes_.contains(keyframe); }
  // In no particular order.
  std::vector<Entry> EntriesOf(KeyFrameId keyframe) const;

  struct MatchOptions {
    std::size_t leaves = 4;    // looked into for each descriptor, up to VocabularyTree::kMaxNearestLeaves
    int max_distance = 60000;  // squared, see kDescriptorLength
    // Of squared distances: the best against the best of another point; 0.8 squared (Lowe 2004).
    double max_ratio = 0.64;
    bool mutual = true;  // no other of the descriptors is nearer to the entry
    // Best and second best are sought in each keyframe by itself: for infinite points, of which two may be
    // the same place seen in two keyframes.
    bool each_keyframe = false;
    KeyFrameId only_keyframe = kNoId, except_keyframe = kNoId;  // kNoId: no such bound
  };
  struct Match {
    std::size_t query = 0;  // index of the descriptor
    Entry entry;
    int distance = 0;  // squared
  };
  // By query, then keyframe; at most one for each point (for each point and keyframe with each_keyframe).
  std::vector<Match> FindMatches(std::span<const Descriptor> queries, const MatchOptions& options) const;

  struct Vote {
    KeyFrameId keyframe = kNoId;
    // What part of the descriptors' leaves the keyframe shares, rare leaves counting more (term frequency and
    // inverse document frequency, Sivic and Zisserman 2003); 1 for the keyframe itself, 0 for nothing shared.
    double score = 0;
  };
  // The `count` keyframes most like an image with these descriptors, best first.
  std::vector<Vote> FindKeyFrames(std::span<const Descriptor> descriptors, std::size_t count,
                                  KeyFrameId except_keyframe = kNoId) const;

  // The same entries, in whatever order.
  bool operator==(const DescriptorDatabase& other) const;

 private:
  // Where a keyframe's entry is kept.
  struct Place {
    std::uint32_t leaf = 0, slot = 0;
  };
  struct Stored {
    KeyFrameId keyframe = kNoId;
    MapPointId point = kNoId;
    Eigen::Vector2f pixel;
    std::uint8_t level = 0;
    std::uint32_t place = 0;  // index in the keyframe's places
  };
  struct Leaf {
    std::vector<Descriptor> descriptors;  // apart, as a query reads all of them and few of the rest
    std::vector<Stored> stored;
  };
  struct Best;
  Entry EntryAt(std::uint32_t leaf, std::uint32_t slot) const;
  void RemovePlace(std::vector<Place>* places, std::size_t index);
  void Look(const Descriptor& query, const MatchOptions& options,
            std::unordered_map<KeyFrameId, Best>* best) const;

  const VocabularyTree* tree_;
  std::vector<Leaf> leaves_;
  std::unordered_map<KeyFrameId, std::vector<Place>> keyframes_;  // never empty ones
  std::size_t size_ = 0;
};

// Adds the descriptors of an observation in its keyframe's image: on its level and `levels_around` coarser
// and finer ones, as far as the patch fits into them, so that it is recognised from nearer and further too.
void AddObservation(const ImageFeatures& features, const Observation& observation, int levels_around,
                    DescriptorDatabase* database);

}  // namespace docent::engine
