// SPDX-License-Identifier: Apache-2.0
#include "engine/base/shared_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "engine/base/bounded_queue.h"
#include "engine/vision/image_pyramid.h"

namespace docent::engine {
namespace {

using FeaturePool = SharedPool<ImageFeatures>;

TEST(SharedPool, LendsABufferAgainAfterItsLastOwnerDroppedIt) {
  FeaturePool pool;
  auto first = pool.Take();
  ImageFeatures* const memory = first.get();
  first->fast_threshold[0] = 17;
  std::shared_ptr<const ImageFeatures> keyframe = first;
  first.reset();
  EXPECT_EQ(pool.free_buffers(), 0u) << "the keyframe still holds it";
  EXPECT_NE(pool.Take().get(), memory);
  keyframe.reset();
  EXPECT_EQ(pool.free_buffers(), 2u);
  EXPECT_EQ(pool.Take().get(), memory);
  EXPECT_EQ(pool.Take()->fast_threshold[0], 17) << "the memory is reused, not made anew";
}

TEST(SharedPool, LendsNoBufferTwiceAtATime) {
  FeaturePool pool;
  std::vector<std::shared_ptr<ImageFeatures>> held;
  std::set<const ImageFeatures*> distinct;
  for (int i = 0; i < 20; ++i) distinct.insert(held.emplace_back(pool.Take()).get());
  EXPECT_EQ(distinct.size(), held.size());
}

TEST(SharedPool, KeepsAFewBuffersWhenAMapIsDiscarded) {
  FeaturePool pool;
  std::vector<std::shared_ptr<ImageFeatures>> map;
  for (std::size_t i = 0; i < 5 * FeaturePool::kMaxFree; ++i) map.push_back(pool.Take());
  map.clear();
  EXPECT_EQ(pool.free_buffers(), FeaturePool::kMaxFree);
}

TEST(SharedPool, MayEndBeforeItsBuffers) {
  std::optional<FeaturePool> pool(std::in_place);
  const auto features = pool->Take();
  pool.reset();
  features->corners[0].resize(100);
  EXPECT_EQ(features->corners[0].size(), 100u);
}

// Under the thread sanitizer this shows that the reader's last access happens before the next write.
TEST(SharedPool, IsSafeWhenAnotherThreadReadsAndDropsTheBuffers) {
  constexpr int kFrames = 2000;
  FeaturePool pool;
  BoundedQueue<std::shared_ptr<const ImageFeatures>> queue(4);
  std::atomic<int> torn = 0;
  std::thread reader([&] {
    while (auto features = queue.Pop()) {
      for (const int threshold : (*features)->fast_threshold)
        torn += threshold != (*features)->fast_threshold[0];
    }
  });
  for (int i = 0; i < kFrames; ++i) {
    auto features = pool.Take();
    features->fast_threshold.fill(i);
    queue.Push(std::move(features));
  }
  queue.Close();
  reader.join();
  EXPECT_EQ(torn, 0);
}

}  // namespace
}  // namespace docent::engine
