// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/vision/descriptor.h"

namespace docent::engine {

// Partitions the space of descriptors into 4096 leaves, the visual words, so that similar descriptors mostly
// share one: a tree of cluster centres with eight children per node and four levels, trained offline by
// k-means within each node (Nister and Stewenius 2006; hybrid-slam §5.4). Immutable; safe to share across
// threads.
class VocabularyTree {
 public:
  static constexpr std::uint32_t kBranching = 8, kLevels = 4, kLeaves = 4096;
  static constexpr std::size_t kCenters = 8 + 64 + 512 + 4096;
  static constexpr std::size_t kBytes = 8 + kCenters * kDescriptorSize + 8;
  static constexpr std::size_t kMaxNearestLeaves = 16;

  // With fewer training descriptors most leaves would get only one or two.
  static constexpr std::size_t kMinTraining = 4 * std::size_t{kLeaves};
  // Trains a tree on at least kMinTraining descriptors (otherwise throws docent::Error) with k-means++ and
  // Lloyd's iteration in every node. The same descriptors and seed give the same tree. progress (may be
  // empty) is called with the number of the kCenters centres that are final.
  static VocabularyTree Train(std::vector<Descriptor> descriptors, std::uint64_t seed,
                              const std::function<void(std::size_t)>& progress = {});

  // Layout: "DOCVOC01"; the centres level by level, the children of a node together, kDescriptorSize bytes
  // each; 64-bit FNV-1a hash of all preceding bytes, little-endian.
  std::vector<std::uint8_t> ToBytes() const;
  // Throws docent::Error with one sentence if the bytes are invalid.
  static VocabularyTree FromBytes(std::span<const std::uint8_t> bytes);
  // Identifies the tree: the FNV-1a hash of its bytes. Leaf numbers of different trees are not comparable.
  std::uint64_t Fingerprint() const;

  // The leaf of a descriptor, reached by descending to the nearest child; of equally near children the first.
  std::uint32_t Leaf(const Descriptor& descriptor) const;
  // Writes up to leaves.size() (1 to kMaxNearestLeaves) nearby leaves, nearest first, and returns their
  // number. As many nodes are followed on every level, because a descriptor may lie just across a cluster
  // border.
  std::size_t NearestLeaves(const Descriptor& descriptor, std::span<std::uint32_t> leaves) const;

  bool operator==(const VocabularyTree&) const = default;

 private:
  VocabularyTree() : centers_(kCenters) {}
  void TrainNode(std::span<Descriptor> descriptors, std::size_t level, std::size_t node, std::uint64_t seed,
                 std::size_t* trained, const std::function<void(std::size_t)>& progress);
  // The first child of a node; level 0 has the eight children of the root.
  static constexpr std::size_t FirstChild(std::size_t level, std::size_t parent) {
    constexpr std::array<std::size_t, kLevels> kBegin = {0, 8, 8 + 64, 8 + 64 + 512};
    return kBegin[level] + parent * kBranching;
  }

  std::vector<Descriptor> centers_;  // by level, then node
};

// The vocabulary that is part of the program, generated from vocabulary.bin by the build (docs/guide.md
// describes its training data).
const VocabularyTree& DefaultVocabulary();

}  // namespace docent::engine
