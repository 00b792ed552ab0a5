// SPDX-License-Identifier: Apache-2.0
#include "engine/base/bounded_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace docent {
namespace {

TEST(BoundedQueue, ReturnsItemsInTheOrderTheyWerePushed) {
  BoundedQueue<int> queue(8);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(queue.Push(i));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(queue.Pop(), i);
  EXPECT_EQ(queue.size(), 0u);
}

TEST(BoundedQueue, NeverExceedsItsCapacityWhileManyThreadsPushAndPop) {
  constexpr int kProducers = 3, kConsumers = 3, kEach = 4000;
  BoundedQueue<int> queue(4);
  std::atomic<long> sum = 0;
  std::atomic<bool> overfull = false;
  std::vector<std::jthread> producers, consumers;
  for (int c = 0; c < kConsumers; ++c) {
    consumers.emplace_back([&] {
      while (const auto item = queue.Pop()) {
        sum += *item;
        if (queue.size() > queue.capacity()) overfull = true;
      }
    });
  }
  for (int p = 0; p < kProducers; ++p) {
    producers.emplace_back([&] {
      for (int i = 1; i <= kEach; ++i) EXPECT_TRUE(queue.Push(i));
    });
  }
  for (auto& producer : producers) producer.join();
  queue.Close();
  for (auto& consumer : consumers) consumer.join();
  EXPECT_EQ(sum, long{kProducers} * kEach * (kEach + 1) / 2);
  EXPECT_FALSE(overfull);
}

TEST(BoundedQueue, PushWaitsWhileTheQueueIsFull) {
  BoundedQueue<int> queue(1);
  ASSERT_TRUE(queue.Push(1));
  std::atomic<bool> popped = false;
  std::atomic<bool> pushed_before_pop = false;
  std::jthread producer([&] {
    EXPECT_TRUE(queue.Push(2));
    if (!popped) pushed_before_pop = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(queue.size(), 1u);
  popped = true;
  EXPECT_EQ(queue.Pop(), 1);
  producer.join();
  EXPECT_FALSE(pushed_before_pop);
  EXPECT_EQ(queue.Pop(), 2);
}

TEST(BoundedQueue, AClosedQueueRejectsNewItemsButReturnsRemainingOnes) {
  BoundedQueue<int> queue(2);
  ASSERT_TRUE(queue.Push(7));
  queue.Close();
  EXPECT_FALSE(queue.Push(8));
  EXPECT_EQ(queue.Pop(), 7);
  EXPECT_EQ(queue.Pop(), std::nullopt);
  EXPECT_TRUE(queue.closed());
}

TEST(BoundedQueue, CloseWakesWaitingThreads) {
  BoundedQueue<int> empty(1), full(1);
  ASSERT_TRUE(full.Push(1));
  std::jthread popper([&] { EXPECT_EQ(empty.Pop(), std::nullopt); });
  std::jthread pusher([&] { EXPECT_FALSE(full.Push(2)); });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // Until both wait.
  empty.Close();
  full.Close();
}

}  // namespace
}  // namespace docent
