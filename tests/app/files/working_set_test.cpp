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

class Thing : public WorkingSet::Member {
 public:
  explicit Thing(std::size_t bytes = 10) : Member(bytes) {}
  int rests() const { return rests_; }

 protected:
  void Rest() const override { ++rests_; }

 private:
  mutable std::atomic<int> rests_{0};
};

TEST(WorkingSet, AsManyAsFitStayAwake) {
  WorkingSet set(30);
  const std::array<Thing, 3> things;
  for (int round = 0; round < 5; ++round)
    for (const Thing& thing : things) set.Look(thing);
  for (const Thing& thing : things) EXPECT_EQ(thing.rests(), 0);
  EXPECT_EQ(set.awake_bytes(), 30u);
}

TEST(WorkingSet, TheEldestRestWhenOthersAreLookedAt) {
  WorkingSet set(30);
  const std::array<Thing, 5> things;
  for (const Thing& thing : things) set.Look(thing);
  EXPECT_EQ(things[0].rests(), 1);
  EXPECT_EQ(things[1].rests(), 1);
  for (std::size_t i = 2; i < things.size(); ++i) EXPECT_EQ(things[i].rests(), 0) << i;
  EXPECT_EQ(set.awake_bytes(), 30u);
}

TEST(WorkingSet, WhatIsLookedAtAgainAndAgainStaysAwakeHoweverManyOthersPass) {
  WorkingSet set(50);
  const Thing at_work;
  const std::array<Thing, 40> others;
  for (int round = 0; round < 3; ++round) {
    for (const Thing& other : others) {
      set.Look(at_work);
      set.Look(other);
    }
  }
  EXPECT_EQ(at_work.rests(), 0);
  for (const Thing& other : others) EXPECT_GE(other.rests(), 2);
}

TEST(WorkingSet, OneThatIsTooLargeIsAwakeAlone) {
  WorkingSet set(30);
  const Thing small, large(100);
  set.Look(small);
  set.Look(large);
  EXPECT_EQ(small.rests(), 1);
  EXPECT_EQ(large.rests(), 0);
  set.Look(small);
  EXPECT_EQ(large.rests(), 1);
  EXPECT_EQ(set.awake_bytes(), 10u);
}

TEST(WorkingSet, AllRestWhenTheyAreToldTo) {
  WorkingSet set(100);
  const std::array<Thing, 3> things;
  set.Look(things[0]);
  set.Look(things[1]);
  set.EvictAll();
  EXPECT_EQ(set.awake_bytes(), 0u);
  EXPECT_EQ(things[0].rests(), 1);
  EXPECT_EQ(things[1].rests(), 1);
  EXPECT_EQ(things[2].rests(), 0);
  set.Look(things[0]);
  EXPECT_EQ(set.awake_bytes(), 10u);
}

TEST(WorkingSet, NothingIsDoneToOneThatWasRemoved) {
  WorkingSet set(30);
  const std::array<Thing, 4> things;
  {
    const auto gone = std::make_unique<Thing>();
    set.Look(*gone);
    set.Remove(*gone);
  }
  EXPECT_EQ(set.awake_bytes(), 0u);
  for (const Thing& thing : things) set.Look(thing);
  set.Remove(things[0]);  // which rests already
  EXPECT_EQ(set.awake_bytes(), 30u);
}

TEST(WorkingSet, ThreadsMayLookAtTheSameThings) {
  WorkingSet set(40);
  const std::array<Thing, 12> things;
  {
    std::vector<std::jthread> threads;
    for (std::size_t k = 0; k < 3; ++k) {
      threads.emplace_back([&, k] {
        for (std::size_t i = 0; i < 20000; ++i) set.Look(things[(i * (k + 1) + i / 7) % things.size()]);
      });
    }
    threads.emplace_back([&] {
      for (int i = 0; i < 200; ++i) set.EvictAll();
    });
  }
  EXPECT_LE(set.awake_bytes(), 40u);
  set.EvictAll();
  for (const Thing& thing : things) set.Look(thing);
  EXPECT_EQ(set.awake_bytes(), 40u);
}

}  // namespace
}  // namespace docent::app
