// SPDX-License-Identifier: Apache-2.0
#include "engine/base/stable_sort.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

namespace docent::engine {
namespace {

// Says where in memory its copies were.
struct alignas(64) Aligned {
  Aligned(int given_key, int given_order) : key(given_key), order(given_order) { Check(); }
  Aligned(const Aligned& other) : key(other.key), order(other.order) { Check(); }
  Aligned& operator=(const Aligned& other) {
    key = other.key;
    order = other.order;
    Check();
    return *this;
  }
  void Check() const {
    if (reinterpret_cast<std::uintptr_t>(this) % alignof(Aligned) != 0) ++misaligned;
  }

  static int misaligned;
  int key, order;
};
int Aligned::misaligned = 0;

TEST(StableSort, KeepsTheOrderOfEqualElements) {
  std::mt19937 random(1);
  for (int size = 0; size < 40; ++size) {
    std::vector<Aligned> elements;
    for (int i = 0; i < size; ++i) elements.emplace_back(static_cast<int>(random() % 5), i);
    StableSort(&elements, [](const Aligned& a, const Aligned& b) { return a.key < b.key; });
    ASSERT_EQ(elements.size(), static_cast<std::size_t>(size));
    for (std::size_t i = 1; i < elements.size(); ++i) {
      const Aligned &a = elements[i - 1], &b = elements[i];
      EXPECT_TRUE(a.key < b.key || (a.key == b.key && a.order < b.order)) << size << ", " << i;
    }
  }
}

TEST(StableSort, KeepsTheAlignmentOfTheElements) {
  Aligned::misaligned = 0;
  for (int size = 2; size < 60; ++size) {
    std::vector<Aligned> elements;
    for (int i = 0; i < size; ++i) elements.emplace_back(i * 37 % size, i);
    StableSort(&elements, [](const Aligned& a, const Aligned& b) { return a.key < b.key; });
  }
  EXPECT_EQ(Aligned::misaligned, 0);
}

}  // namespace
}  // namespace docent::engine
