// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/point_id_set.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

std::vector<MapPointId> All(const PointIdSet& set) {
  std::vector<MapPointId> ids;
  set.ForEach([&](MapPointId id) { ids.push_back(id); });
  return ids;
}

TEST(PointIdSet, IteratesOverEachIdOnceInOrder) {
  Random random(1);
  PointIdSet set;
  set.Clear(1000);
  std::set<MapPointId> expected;
  for (int i = 0; i < 400; ++i) {
    const MapPointId id = random.Below(1000);
    set.Insert(id);
    expected.insert(id);
  }
  EXPECT_EQ(All(set), std::vector<MapPointId>(expected.begin(), expected.end()));
  for (MapPointId id = 0; id < 1000; ++id) EXPECT_EQ(set.Contains(id), expected.count(id) == 1);
}

TEST(PointIdSet, HoldsTheFirstAndLastIdAndIgnoresIdsBeyond) {
  PointIdSet set;
  for (const MapPointId end : {1u, 63u, 64u, 65u, 128u}) {
    set.Clear(end);
    EXPECT_TRUE(All(set).empty());
    set.Insert(0);
    set.Insert(end - 1);
    set.Insert(kNoId);
    EXPECT_TRUE(set.Contains(0));
    EXPECT_TRUE(set.Contains(end - 1));
    EXPECT_FALSE(set.Contains(kNoId));
    EXPECT_EQ(All(set).size(), end == 1 ? 1u : 2u);
  }
  set.Clear(0);
  set.Insert(0);
  EXPECT_FALSE(set.Contains(0));
}

}  // namespace
}  // namespace docent::engine
