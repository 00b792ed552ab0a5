// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/random.h"
#include "engine/recognition/vocabulary_tree.h"

// Random descriptors for the tests of the vocabulary and of descriptor matching.
namespace docent::engine::testing_descriptors {

// A random descriptor of the standard length.
inline Descriptor MadeDescriptor(Random* random) {
  std::array<double, kDescriptorSize> values;
  double squared = 0;
  for (double& value : values) {
    value = random->Uniform() * random->Uniform();
    squared += value * value;
  }
  Descriptor descriptor;
  for (std::size_t i = 0; i < values.size(); ++i) {
    descriptor.values[i] =
        static_cast<std::uint8_t>(std::min(255.0, kDescriptorLength * values[i] / std::sqrt(squared)));
  }
  return descriptor;
}

// Each element changed by up to `max_change`.
inline Descriptor Disturbed(Descriptor descriptor, int max_change, Random* random) {
  for (std::uint8_t& value : descriptor.values) {
    const int change =
        static_cast<int>(random->Below(static_cast<std::uint32_t>(2 * max_change + 1))) - max_change;
    value = static_cast<std::uint8_t>(std::clamp(value + change, 0, 255));
  }
  return descriptor;
}

// `count` descriptors around `clusters` cluster centres.
inline std::vector<Descriptor> Clustered(std::size_t count, std::size_t clusters, std::uint64_t seed) {
  Random random(seed);
  std::vector<Descriptor> centers, descriptors;
  for (std::size_t i = 0; i < clusters; ++i) centers.push_back(MadeDescriptor(&random));
  for (std::size_t i = 0; i < count; ++i) descriptors.push_back(Disturbed(centers[i % clusters], 8, &random));
  return descriptors;
}

inline const VocabularyTree& MadeTree() {
  static const VocabularyTree tree = VocabularyTree::Train(Clustered(20000, 6000, 77), 1);
  return tree;
}

}  // namespace docent::engine::testing_descriptors
