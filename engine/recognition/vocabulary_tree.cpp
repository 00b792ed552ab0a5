// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/vocabulary_tree.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/base/random.h"

namespace docent::engine {

// Defined in a source that the build generates from vocabulary.bin.
extern const unsigned char vocabulary_bytes[];
extern const std::size_t vocabulary_bytes_size;

namespace {

constexpr std::size_t kBranching = VocabularyTree::kBranching;
constexpr std::array<std::uint8_t, 8> kMagic = {'D', 'O', 'C', 'V', 'O', 'C', '0', '1'};
constexpr int kMaxIterations = 30;

using Centers = std::array<Descriptor, kBranching>;

std::uint64_t Fnv1a(std::span<const std::uint8_t> bytes) {
  std::uint64_t hash = 0xCBF29CE484222325ull;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001B3ull;
  return hash;
}

std::size_t Nearest(const Descriptor* centers, const Descriptor& descriptor) {
  std::size_t best = 0;
  int least = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < kBranching; ++i) {
    const int distance = SquaredDistance(centers[i], descriptor);
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

// Distant initial centres: each next one is drawn with a probability proportional to the squared distance
// from the previous ones (k-means++, Arthur and Vassilvitskii 2007).
Centers SpreadCenters(std::span<const Descriptor> descriptors, Random* random) {
  Centers centers;
  centers.fill(descriptors[random->Below(static_cast<std::uint32_t>(descriptors.size()))]);
  std::vector<int> distance(descriptors.size(), std::numeric_limits<int>::max());
  for (std::size_t k = 1; k < kBranching; ++k) {
    double sum = 0;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      distance[i] = std::min(distance[i], SquaredDistance(descriptors[i], centers[k - 1]));
      sum += distance[i];
    }
    if (sum <= 0) break;  // fewer distinct descriptors than children: the others stay empty
    double left = random->Uniform() * sum;
    std::size_t chosen = 0;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      if (distance[i] == 0) continue;
      chosen = i;
      left -= distance[i];
      if (left < 0) break;
    }
    centers[k] = descriptors[chosen];
  }
  return centers;
}

// Lloyd's iteration on rounded centres, so that training assigns descriptors as a later descent does. Returns
// each descriptor's cluster.
std::vector<std::uint8_t> Cluster(std::span<const Descriptor> descriptors, Centers* centers) {
  std::vector<std::uint8_t> assigned(descriptors.size(), kBranching);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    std::array<std::array<std::int64_t, kDescriptorSize>, kBranching> sums{};
    std::array<std::int64_t, kBranching> counts{};
    bool changed = false;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      const std::size_t nearest = Nearest(centers->data(), descriptors[i]);
      changed = changed || assigned[i] != nearest;
      assigned[i] = static_cast<std::uint8_t>(nearest);
      ++counts[nearest];
      for (std::size_t j = 0; j < kDescriptorSize; ++j) sums[nearest][j] += descriptors[i].values[j];
    }
    if (!changed || iteration + 1 == kMaxIterations) break;
    for (std::size_t k = 0; k < kBranching; ++k) {
      if (counts[k] == 0) continue;
      for (std::size_t j = 0; j < kDescriptorSize; ++j)
        (*centers)[k].values[j] = static_cast<std::uint8_t>((sums[k][j] + counts[k] / 2) / counts[k]);
    }
  }
  return assigned;
}

}  // namespace

void VocabularyTree::TrainNode(std::span<Descriptor> descriptors, std::size_t level, std::size_t node,
                               std::uint64_t seed, std::size_t* trained,
                               const std::function<void(std::size_t)>& progress) {
  Centers centers{};
  std::array<std::size_t, kBranching + 1> begin{};
  if (!descriptors.empty()) {
    // Each node has its own seed, so that nodes do not influence each other.
    Random random(seed ^ (0x9E3779B97F4A7C15ull * (FirstChild(level, node) + 1)));
    centers = SpreadCenters(descriptors, &random);
    const std::vector<std::uint8_t> assigned = Cluster(descriptors, &centers);
    for (const std::uint8_t cluster : assigned) ++begin[cluster + std::size_t{1}];
    for (std::size_t k = 0; k < kBranching; ++k) begin[k + 1] += begin[k];
    std::vector<Descriptor> sorted(descriptors.size());
    std::array<std::size_t, kBranching + 1> next = begin;
    for (std::size_t i = 0; i < descriptors.size(); ++i) sorted[next[assigned[i]]++] = descriptors[i];
    std::copy(sorted.begin(), sorted.end(), descriptors.begin());
  }
  std::copy(centers.begin(), centers.end(),
            centers_.begin() + static_cast<std::ptrdiff_t>(FirstChild(level, node)));
  *trained += kBranching;
  if (progress) progress(*trained);
  if (level + 1 == kLevels) return;
  for (std::size_t k = 0; k < kBranching; ++k) {
    TrainNode(descriptors.subspan(begin[k], begin[k + 1] - begin[k]), level + 1, node * kBranching + k, seed,
              trained, progress);
  }
}

VocabularyTree VocabularyTree::Train(std::vector<Descriptor> descriptors, std::uint64_t seed,
                                     const std::function<void(std::size_t)>& progress) {
  if (descriptors.size() < kMinTraining) {
    throw Error("A vocabulary needs at least " + std::to_string(kMinTraining) +
                " descriptors, and there are " + std::to_string(descriptors.size()) +
                "; give more images, or images with more texture.");
  }
  VocabularyTree tree;
  std::size_t trained = 0;
  tree.TrainNode(descriptors, 0, 0, seed, &trained, progress);
  return tree;
}

std::vector<std::uint8_t> VocabularyTree::ToBytes() const {
  std::vector<std::uint8_t> bytes(kMagic.begin(), kMagic.end());
  bytes.reserve(kBytes);
  for (const Descriptor& center : centers_)
    bytes.insert(bytes.end(), center.values.begin(), center.values.end());
  const std::uint64_t hash = Fnv1a(bytes);
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<std::uint8_t>(hash >> (8 * i)));
  return bytes;
}

VocabularyTree VocabularyTree::FromBytes(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
    throw Error("This is not a vocabulary: it does not begin with DOCVOC01.");
  if (bytes.size() != kBytes) {
    throw Error("This vocabulary has " + std::to_string(bytes.size()) + " bytes instead of " +
                std::to_string(kBytes) + "; train it again with 'docent train-vocabulary'.");
  }
  std::uint64_t hash = 0;
  for (std::size_t i = 0; i < 8; ++i) hash |= std::uint64_t{bytes[kBytes - 8 + i]} << (8 * i);
  if (hash != Fnv1a(bytes.first(kBytes - 8)))
    throw Error(
        "This vocabulary is damaged: its checksum is wrong; train it again with 'docent train-vocabulary'.");
  VocabularyTree tree;
  const std::uint8_t* next = bytes.data() + kMagic.size();
  for (Descriptor& center : tree.centers_) {
    std::copy_n(next, kDescriptorSize, center.values.begin());
    next += kDescriptorSize;
  }
  return tree;
}

std::uint64_t VocabularyTree::Fingerprint() const {
  const std::vector<std::uint8_t> bytes = ToBytes();
  return Fnv1a(std::span(bytes).first(kBytes - 8));
}

std::uint32_t VocabularyTree::Leaf(const Descriptor& descriptor) const {
  std::size_t node = 0;
  for (std::size_t level = 0; level < kLevels; ++level)
    node = node * kBranching + Nearest(&centers_[FirstChild(level, node)], descriptor);
  return static_cast<std::uint32_t>(node);
}

std::size_t VocabularyTree::NearestLeaves(const Descriptor& descriptor,
                                          std::span<std::uint32_t> leaves) const {
  struct Node {
    int distance;
    std::uint32_t index;
    bool operator<(const Node& other) const {
      return distance != other.distance ? distance < other.distance : index < other.index;
    }
  };
  const std::size_t wanted = std::min(leaves.size(), kMaxNearestLeaves);
  std::array<Node, kMaxNearestLeaves * kBranching> children;
  std::array<Node, kMaxNearestLeaves> kept{Node{0, 0}};
  std::size_t kept_count = wanted > 0 ? 1 : 0;
  for (std::size_t level = 0; level < kLevels; ++level) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < kept_count; ++i) {
      const Descriptor* centers = &centers_[FirstChild(level, kept[i].index)];
      for (std::uint32_t k = 0; k < kBranching; ++k)
        children[count++] = {SquaredDistance(centers[k], descriptor), kept[i].index * kBranching + k};
    }
    kept_count = std::min(wanted, count);
    std::partial_sort_copy(children.begin(), children.begin() + static_cast<std::ptrdiff_t>(count),
                           kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(kept_count));
  }
  for (std::size_t i = 0; i < kept_count; ++i) leaves[i] = kept[i].index;
  return kept_count;
}

const VocabularyTree& DefaultVocabulary() {
  static const VocabularyTree tree = VocabularyTree::FromBytes({vocabulary_bytes, vocabulary_bytes_size});
  return tree;
}

}  // namespace docent::engine
