// SPDX-License-Identifier: Apache-2.0
#include "app/files/working_set.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <thread>
#include <vector>

namespace docent::app {
namespace {

class CountingMember : public WorkingSet::Member {
 public:
  explicit CountingMember(std::size_t bytes = 10) : Member(bytes) {}
  int evictions() const { return evictions_; }

 protected:
  void ReleaseMemory() const override { ++evictions_; }

 private:
  mutable std::atomic<int> evictions_{0};
};

TEST(WorkingSet, MembersThatFitStayResident) {
  WorkingSet set(30);
  const std::array<CountingMember, 3> members;
  for (int round = 0; round < 5; ++round)
    for (const CountingMember& member : members) set.Touch(member);
  for (const CountingMember& member : members) EXPECT_EQ(member.evictions(), 0);
  EXPECT_EQ(set.resident_bytes(), 30u);
}

TEST(WorkingSet, TheOldestAreEvictedWhenOthersAreUsed) {
  WorkingSet set(30);
  const std::array<CountingMember, 5> members;
  for (const CountingMember& member : members) set.Touch(member);
  EXPECT_EQ(members[0].evictions(), 1);
  EXPECT_EQ(members[1].evictions(), 1);
  for (std::size_t i = 2; i < members.size(); ++i) EXPECT_EQ(members[i].evictions(), 0) << i;
  EXPECT_EQ(set.resident_bytes(), 30u);
}

TEST(WorkingSet, AMemberInConstantUseStaysResident) {
  WorkingSet set(50);
  const CountingMember at_work;
  const std::array<CountingMember, 40> others;
  for (int round = 0; round < 3; ++round) {
    for (const CountingMember& other : others) {
      set.Touch(at_work);
      set.Touch(other);
    }
  }
  EXPECT_EQ(at_work.evictions(), 0);
  for (const CountingMember& other : others) EXPECT_GE(other.evictions(), 2);
}

TEST(WorkingSet, AMemberLargerThanTheLimitIsResidentAlone) {
  WorkingSet set(30);
  const CountingMember small, large(100);
  set.Touch(small);
  set.Touch(large);
  EXPECT_EQ(small.evictions(), 1);
  EXPECT_EQ(large.evictions(), 0);
  set.Touch(small);
  EXPECT_EQ(large.evictions(), 1);
  EXPECT_EQ(set.resident_bytes(), 10u);
}

TEST(WorkingSet, EvictAllEvictsAllResidentMembers) {
  WorkingSet set(100);
  const std::array<CountingMember, 3> members;
  set.Touch(members[0]);
  set.Touch(members[1]);
  set.EvictAll();
  EXPECT_EQ(set.resident_bytes(), 0u);
  EXPECT_EQ(members[0].evictions(), 1);
  EXPECT_EQ(members[1].evictions(), 1);
  EXPECT_EQ(members[2].evictions(), 0);
  set.Touch(members[0]);
  EXPECT_EQ(set.resident_bytes(), 10u);
}

TEST(WorkingSet, ARemovedMemberIsNotAccessed) {
  WorkingSet set(30);
  const std::array<CountingMember, 4> members;
  {
    const auto gone = std::make_unique<CountingMember>();
    set.Touch(*gone);
    set.Remove(*gone);
  }
  EXPECT_EQ(set.resident_bytes(), 0u);
  for (const CountingMember& member : members) set.Touch(member);
  set.Remove(members[0]);  // already evicted
  EXPECT_EQ(set.resident_bytes(), 30u);
}

TEST(WorkingSet, ThreadsMayUseTheSameMembers) {
  WorkingSet set(40);
  const std::array<CountingMember, 12> members;
  {
    std::vector<std::jthread> threads;
    for (std::size_t k = 0; k < 3; ++k) {
      threads.emplace_back([&, k] {
        for (std::size_t i = 0; i < 20000; ++i) set.Touch(members[(i * (k + 1) + i / 7) % members.size()]);
      });
    }
    threads.emplace_back([&] {
      for (int i = 0; i < 200; ++i) set.EvictAll();
    });
  }
  EXPECT_LE(set.resident_bytes(), 40u);
  set.EvictAll();
  for (const CountingMember& member : members) set.Touch(member);
  EXPECT_EQ(set.resident_bytes(), 40u);
}

}  // namespace
}  // namespace docent::app
