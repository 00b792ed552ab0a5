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

// Parts the space of descriptors into 4096 leaves, so that like descriptors mostly share one: a tree of
// cluster centres, eight children a node, four levels, made once and offline by k-means within each node
// (Nister and Stewenius 2006; hybrid-slam §5.4). Immutable; safe to share across threads.
class VocabularyTree {
 public:
  static constexpr std::uint32_t kBranching = 8, kLevels = 4, kLeaves = 4096;
  static constexpr std::size_t kCenters = 8 + 64 + 512 + 4096;
  static constexpr std::size_t kBytes = 8 + kCenters * kDescriptorSize + 8;
  static constexpr std::size_t kMaxNearestLeaves = 16;

  // Fewer would leave most leaves with a descriptor or two.
  static constexpr std::size_t kMinTraining = 4 * std::size_t{kLeaves};
  // The tree of these descriptors (at least kMinTraining, else throws docent::Error): k-means++ and Lloyd's
  // iteration in every node. The same descriptors and seed give the same tree. progress (may be empty) hears
  // how many of the kCenters centres are settled.
  static VocabularyTree Train(std::vector<Descriptor> descriptors, std::uint64_t seed,
                              const std::function<void(std::size_t)>& progress = {});

  // Layout: "DOCVOC01"; the centres level by level, each node's children together, kDescriptorSize bytes
  // each; FNV-1a of all before, 64 bits, little-endian.
  std::vector<std::uint8_t> ToBytes() const;
  // Throws docent::Error with one sentence when the bytes are anything else.
  static VocabularyTree FromBytes(std::span<const std::uint8_t> bytes);
  // Names the tree: the FNV-1a of its bytes. What is kept of one tree's leaves means nothing under another.
  std::uint64_t Fingerprint() const;

  // The leaf that a descriptor falls into, going to the nearest child each time; the first of equally near.
  std::uint32_t Leaf(const Descriptor& descriptor) const;
  // Up to leaves.size() (1 to kMaxNearestLeaves) leaves whose centres are near, nearest first, for a
  // descriptor that may have fallen on the other side of a border: as many nodes are followed on every level.
  // Returns how many.
  std::size_t NearestLeaves(const Descriptor& descriptor, std::span<std::uint32_t> leaves) const;

  const Descriptor& LeafCenter(std::uint32_t leaf) const { return centers_[kCenters - kLeaves + leaf]; }
  bool operator==(const VocabularyTree&) const = default;

 private:
  VocabularyTree() : centers_(kCenters) {}
  void Settle(std::span<Descriptor> descriptors, std::size_t level, std::size_t node, std::uint64_t seed,
              std::size_t* settled, const std::function<void(std::size_t)>& progress);
  // The first of the children of a node; level 0 has the eight below the root.
  static constexpr std::size_t FirstChild(std::size_t level, std::size_t parent) {
    constexpr std::array<std::size_t, kLevels> kBegin = {0, 8, 8 + 64, 8 + 64 + 512};
    return kBegin[level] + parent * kBranching;
  }

  std::vector<Descriptor> centers_;  // by level, then node
};

// The vocabulary that comes with the program, out of vocabulary.bin as it was when this was built (the README
// says what it was trained on).
const VocabularyTree& DefaultVocabulary();

}  // namespace docent::engine
