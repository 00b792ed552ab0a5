// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a vocabulary: the result must be a tree or a docent::Error.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/error.h"
#include "engine/recognition/vocabulary_tree.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using docent::engine::VocabularyTree;
  try {
    const VocabularyTree tree = VocabularyTree::FromBytes({data, size});
    // An accepted tree must give the same bytes again.
    if (tree.ToBytes() != std::vector<std::uint8_t>(data, data + size)) __builtin_trap();
  } catch (const docent::Error&) {
  }
  return 0;
}
