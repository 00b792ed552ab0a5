// SPDX-License-Identifier: Apache-2.0
#include "app/session/mapping_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "app/simulator/simulation.h"
#include "engine/vision/features.h"

namespace docent::app {
namespace {

using std::chrono::hours;
using std::chrono::steady_clock;

// Enough corners for a map to begin with.
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

// A mapper that is held at its first news until it is let go.
class HeldMapper : public ::testing::Test {
 protected:
  HeldMapper() {
    mapping_.Adopt(1, nullptr);
    mapping_.WaitUntilIdle(steady_clock::now() + hours(1), {});
    EXPECT_TRUE(mapping_.Resting());
    EXPECT_TRUE(mapping_.Offer(1, FirstKeyFrame(), {}));
    EXPECT_EQ(told_.get_future().wait_for(std::chrono::minutes(1)), std::future_status::ready);
  }
  ~HeldMapper() override {
    if (!let_go_) Evict();
  }
  void Evict() {
    let_go_ = true;
    go_.set_value();
  }

  std::promise<void> told_, go_;
  std::atomic<bool> let_go_ = false;
  MappingThread mapping_{{}, true, [this](const MappingThread::MapperUpdate&) {
                           if (let_go_) return;
                           told_.set_value();
                           go_.get_future().wait();
                         }};
};

TEST_F(HeldMapper, HoldsAFeederNoLongerThanTheCameraWouldWait) {
  mapping_.WaitUntilIdle(steady_clock::now(), {});
  EXPECT_FALSE(mapping_.Resting());
}

TEST_F(HeldMapper, HoldsAFeederThatIsFasterThanACameraUntilItRests) {
  std::thread later([this] { Evict(); });
  mapping_.WaitUntilIdle(steady_clock::now() + hours(1), {});
  EXPECT_TRUE(let_go_);
  EXPECT_TRUE(mapping_.Resting());
  later.join();
}

TEST_F(HeldMapper, HoldsAFeederThatIsAWholeKeyFrameAheadHoweverLong) {
  auto second = FirstKeyFrame(), third = FirstKeyFrame();
  second.time = FromSeconds(1);
  third.time = FromSeconds(2);
  ASSERT_TRUE(mapping_.Offer(1, second, {}));
  ASSERT_TRUE(mapping_.Offer(1, third, {}));
  std::thread later([this] { Evict(); });
  mapping_.WaitUntilIdle(steady_clock::now(), {});
  EXPECT_TRUE(let_go_);
  later.join();
}

TEST_F(HeldMapper, LetsAFeederGoThatIsToldToStop) {
  std::stop_source stop;
  stop.request_stop();
  mapping_.WaitUntilIdle(steady_clock::now() + hours(1), stop.get_token());
  EXPECT_FALSE(mapping_.Resting());
}

}  // namespace
}  // namespace docent::app
