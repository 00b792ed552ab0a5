// SPDX-License-Identifier: Apache-2.0
#include "engine/system/mapping_thread.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <thread>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/vision/features.h"

namespace docent::app {
namespace {

using std::chrono::hours;
using std::chrono::steady_clock;

// Has enough corners to initialize a map.
cv::Mat ImageOfBlocks() {
  cv::Mat blocks(30, 40, CV_8UC1), image;
  cv::theRNG().state = 7;
  cv::randu(blocks, 0, 256);
  cv::resize(blocks, image, {}, 8, 8, cv::INTER_NEAREST);
  return image;
}

engine::KeyFrameCandidate FirstKeyFrame() {
  engine::KeyFrameCandidate first;
  first.choice = engine::KeyFrameChoice::kFirst;
  first.camera = std::make_shared<engine::CameraModel>(SimulatedCamera(320));
  first.features = engine::MakeFeatures(ImageOfBlocks());
  return first;
}

// A mapper that blocks in the callback of its first update until it is released.
class HeldMapper : public ::testing::Test {
 protected:
  HeldMapper() {
    adoption_ = mapping_.Adopt(1, nullptr);
    mapping_.WaitUntilIdle(steady_clock::now() + hours(1), {});
    EXPECT_TRUE(mapping_.IsIdle());
    EXPECT_TRUE(mapping_.Offer(1, FirstKeyFrame(), {}));
    EXPECT_EQ(first_update_.get_future().wait_for(std::chrono::minutes(1)), std::future_status::ready);
  }
  ~HeldMapper() override {
    if (!released_) Release();
  }
  void Release() {
    released_ = true;
    release_.set_value();
  }

  std::uint64_t adoption_ = 0, held_adoption_ = 0;
  std::promise<void> first_update_, release_;
  std::atomic<bool> released_ = false;
  engine::MappingThread mapping_{{}, true, [this](const engine::MappingThread::MapperUpdate& update) {
                                   if (released_) return;
                                   held_adoption_ = update.adoption;
                                   first_update_.set_value();
                                   release_.get_future().wait();
                                 }};
};

TEST_F(HeldMapper, DelaysASourceUntilTheGivenTimeOnly) {
  mapping_.WaitUntilIdle(steady_clock::now(), {});
  EXPECT_FALSE(mapping_.IsIdle());
}

TEST_F(HeldMapper, DelaysAFastSourceUntilItIsIdle) {
  std::thread later([this] { Release(); });
  mapping_.WaitUntilIdle(steady_clock::now() + hours(1), {});
  EXPECT_TRUE(released_);
  EXPECT_TRUE(mapping_.IsIdle());
  later.join();
}

TEST_F(HeldMapper, DelaysASourceBeyondTheGivenTimeWhenAKeyFrameBehind) {
  auto second = FirstKeyFrame(), third = FirstKeyFrame();
  second.time = FromSeconds(1);
  third.time = FromSeconds(2);
  ASSERT_TRUE(mapping_.Offer(1, second, {}));
  ASSERT_TRUE(mapping_.Offer(1, third, {}));
  std::thread later([this] { Release(); });
  mapping_.WaitUntilIdle(steady_clock::now(), {});
  EXPECT_TRUE(released_);
  later.join();
}

TEST_F(HeldMapper, TellsUpdatesFromThoseBeforeTheSameMapWasAdoptedAgain) {
  EXPECT_EQ(held_adoption_, adoption_);
  EXPECT_GT(mapping_.Adopt(1, nullptr), held_adoption_);
}

TEST_F(HeldMapper, EndsTheDelayWhenStopIsRequested) {
  std::stop_source stop;
  stop.request_stop();
  mapping_.WaitUntilIdle(steady_clock::now() + hours(1), stop.get_token());
  EXPECT_FALSE(mapping_.IsIdle());
}

TEST(MappingThread, TakesNothingAfterItHasFailed) {
  std::promise<void> failed;
  engine::MappingThread mapping({}, true, [&](const engine::MappingThread::MapperUpdate& update) {
    if (update.failure.empty()) throw std::runtime_error("broken");
    failed.set_value();
  });
  mapping.Adopt(1, nullptr);
  mapping.WaitUntilIdle(steady_clock::now() + hours(1), {});
  ASSERT_TRUE(mapping.Offer(1, FirstKeyFrame(), {}));
  ASSERT_EQ(failed.get_future().wait_for(std::chrono::minutes(2)), std::future_status::ready);
  EXPECT_FALSE(mapping.Offer(1, FirstKeyFrame(), {})) << "its reports would only fill the memory";
  EXPECT_THROW(mapping.Finish(), std::runtime_error);
}

TEST(MappingThread, KeepsAnInitialPairWhileTheQueueIsFull) {
  std::vector<engine::MapperEvent> events;
  engine::MappingThread mapping({}, false, [&](const engine::MappingThread::MapperUpdate& update) {
    events.insert(events.end(), update.events.begin(), update.events.end());
  });
  mapping.Adopt(1, nullptr);
  const engine::KeyFrameCandidate candidate = FirstKeyFrame();
  for (std::size_t i = 0; i < engine::MapperOptions().max_queue; ++i)
    ASSERT_TRUE(mapping.Offer(1, candidate, {}));
  engine::InitialPair without_matches;
  without_matches.camera = candidate.camera;
  without_matches.a.features = without_matches.b.features = candidate.features;
  without_matches.b.time = FromSeconds(1);
  without_matches.geometry.b_from_a.translation.x() = 1;
  ASSERT_TRUE(mapping.Start(1, without_matches));
  mapping.RunLockstep();
  mapping.RunLockstep();
  EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const engine::MapperEvent& event) {
    return std::holds_alternative<engine::MapperEvent::StartFailed>(event.what);
  })) << "the pair was dropped, and the camera waits for its map for ever";
}

}  // namespace
}  // namespace docent::app
