// SPDX-License-Identifier: Apache-2.0
#include "app/session/map_keys.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

maps::Library OpenLibrary(const TemporaryFolder& folder) {
  return maps::Library::Open(folder / "a.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
}

TEST(MapKeys, CountUpWithoutALibrary) {
  MapKeys keys(nullptr);
  EXPECT_EQ(keys.TryTake(), 1u);
  EXPECT_EQ(keys.Take(), 2u);
}

TEST(MapKeys, AreGivenOutOnceByTwoSessionsOfOneLibrary) {
  const TemporaryFolder folder;
  maps::Library first = OpenLibrary(folder), second = OpenLibrary(folder);
  MapKeys a(&first), b(&second);
  std::set<std::uint64_t> taken;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(taken.insert(a.Take()).second);
    EXPECT_TRUE(taken.insert(b.Take()).second);
  }
}

TEST(MapKeys, AreNotAskedOfTheDiskWhileReservedOnesAreLeft) {
  const TemporaryFolder folder;
  maps::Library library = OpenLibrary(folder);
  MapKeys keys(&library);
  int reserved = 0;
  while (keys.TryTake() != 0) ++reserved;
  EXPECT_EQ(reserved, 64);
  EXPECT_NE(keys.Take(), 0u);
  keys.Refill();
  EXPECT_NE(keys.TryTake(), 0u);
}

}  // namespace
}  // namespace docent::app
