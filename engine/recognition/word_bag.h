// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/recognition/vocabulary_tree.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// A visual word and its count in an image, in two bytes. Similar descriptors share a word (Sivic and
// Zisserman 2003). Counts are limited to kMaxCount.
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

// The visual words of an image without their positions: by ascending leaf, each leaf once. Mostly invariant
// to roll, small changes of distance and direction.
using WordBag = std::vector<VisualWord>;

struct WordBagOptions {
  // The finest level is not used: its corners are affected most by noise and motion blur, and each word has a
  // cost. A 640x480 image has about 190 words.
  CornerDescriptionOptions corners{.corners = {0, 60, 60, 40}, .min_score = 20};

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const { return corners.Validate(); }
};

// The words of the best corners of an image. The same features and tree give the same words.
WordBag MakeWordBag(const ImageFeatures& features, const VocabularyTree& tree = DefaultVocabulary(),
                    const WordBagOptions& options = {});
// A word bag of leaves in any order.
WordBag MakeWordBag(std::vector<std::uint32_t> leaves);

}  // namespace docent::engine
