// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/word_bag.h"

#include <array>

#include "engine/base/option_check.h"

namespace docent::engine {

WordBag MakeWordBag(std::vector<std::uint32_t> leaves) {
  std::sort(leaves.begin(), leaves.end());
  WordBag bag;
  for (std::size_t begin = 0, end = 0; begin < leaves.size(); begin = end) {
    while (end < leaves.size() && leaves[end] == leaves[begin]) ++end;
    bag.emplace_back(leaves[begin],
                     static_cast<int>(std::min<std::size_t>(end - begin, VisualWord::kMaxCount)));
  }
  return bag;
}

WordBag MakeWordBag(const ImageFeatures& features, const VocabularyTree& tree,
                    const WordBagOptions& options) {
  Checked(options);
  std::vector<std::uint32_t> leaves;
  for (const DescribedKeypoint& place : DescribeCorners(features, options.corners)) {
    // The nearest of the leaves that a descent along several branches reaches: a descent along one branch
    // often misses it because of an early decision.
    std::array<std::uint32_t, 4> nearest;
    tree.NearestLeaves(place.oriented.descriptor, nearest);
    leaves.push_back(nearest[0]);
  }
  return MakeWordBag(std::move(leaves));
}

}  // namespace docent::engine
