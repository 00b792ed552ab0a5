// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/recognition/vocabulary_tree.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// A leaf of the vocabulary tree and how often an image has it, in two bytes: what looks alike has one word
// (Sivic and Zisserman 2003). A word that is there more often than kMaxCount counts as kMaxCount.
class VisualWord {
 public:
  static constexpr int kMaxCount = 16;
  static_assert(VocabularyTree::kLeaves <= 4096, "a leaf's number takes twelve bits");

  // leaf < VocabularyTree::kLeaves, count > 0.
  VisualWord(std::uint32_t leaf, int count)
      : bits_(static_cast<std::uint16_t>(leaf << 4 |
                                         static_cast<std::uint32_t>(std::min(count, kMaxCount) - 1))) {}
  static VisualWord FromBits(std::uint16_t bits) { return VisualWord(bits >> 4, (bits & 15) + 1); }

  std::uint32_t leaf() const { return bits_ >> 4; }
  int count() const { return (bits_ & 15) + 1; }
  std::uint16_t bits() const { return bits_; }
  bool operator==(const VisualWord&) const = default;

 private:
  std::uint16_t bits_;
};

// What an image shows, without where: by ascending leaf, each leaf once. Where a camera rolls, comes nearer
// or looks aside, the words that stay in sight stay the same.
using WordBag = std::vector<VisualWord>;

struct WordBagOptions {
  // None of the finest level: its corners are noise and motion blur first of all, and every word has its
  // price. An image of 640 x 480 gets about 190 words.
  CornerDescriptionOptions corners{.corners = {0, 60, 60, 40}, .min_score = 20};
};

// The words of the best corners of an image. The same features and tree give the same words.
WordBag MakeWordBag(const ImageFeatures& features, const VocabularyTree& tree = DefaultVocabulary(),
                    const WordBagOptions& options = {});
// Of leaves in any order.
WordBag MakeWordBag(std::vector<std::uint32_t> leaves);

}  // namespace docent::engine
