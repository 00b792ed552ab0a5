// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/map_initialization.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::ImageAt;
using Phase = MapInitialization::Phase;

// A camera that moves sideways by a centimetre per frame, without panorama maps.
class SidewaysWalk : public ::testing::Test {
 protected:
  static TrackerOptions WithoutPanoramas() {
    TrackerOptions options;
    options.hybrid = false;
    return options;
  }
  TrackedFrame Next() {
    const CameraImage image = ImageAt(CameraAt({0.01 * frame_, 0, 0}), frame_);
    ++frame_;
    initialization_.BeginFrame();
    TrackedFrame out;
    initialization_.Search(image, nullptr, kNoId, Eigen::Vector3d::Zero(), &out);
    return out;
  }
  void WalkUntilThePair() {
    for (int i = 0; i < 60 && initialization_.phase() == Phase::kSearching; ++i) Next();
  }
  MapInitialization initialization_{WithoutPanoramas(), Camera(), 1, 2};
  int frame_ = 0;
};

TEST_F(SidewaysWalk, GivesAPairOnce) {
  EXPECT_EQ(initialization_.phase(), Phase::kOff);
  initialization_.Begin();
  EXPECT_EQ(Next().state, TrackingState::kInitializing);
  EXPECT_FALSE(initialization_.TakePair());
  WalkUntilThePair();
  ASSERT_EQ(initialization_.phase(), Phase::kPairGiven);
  const auto pair = initialization_.TakePair();
  ASSERT_TRUE(pair);
  EXPECT_LT(pair->a.time, pair->b.time);
  EXPECT_NEAR(std::abs(pair->geometry.b_from_a.translation.normalized().x()), 1, 0.01);
  EXPECT_FALSE(initialization_.TakePair());
}

TEST_F(SidewaysWalk, WaitsForTheMapOfThePairAndSearchesAgainWhenItFails) {
  initialization_.Begin();
  WalkUntilThePair();
  ASSERT_EQ(initialization_.phase(), Phase::kPairGiven);
  EXPECT_EQ(Next().hint, Hint::kWaitForMap);
  EXPECT_FALSE(initialization_.TakePair());
  initialization_.PairFailed();
  EXPECT_EQ(initialization_.phase(), Phase::kSearching);
  WalkUntilThePair();
  EXPECT_EQ(initialization_.phase(), Phase::kPairGiven);
  initialization_.Finish();
  EXPECT_FALSE(initialization_.is_on());
}

TEST_F(SidewaysWalk, IsForgottenWhenTheSearchStops) {
  initialization_.Begin();
  WalkUntilThePair();
  initialization_.Stop();
  EXPECT_FALSE(initialization_.is_on());
  EXPECT_FALSE(initialization_.TakePair());
  initialization_.PairFailed();
  EXPECT_FALSE(initialization_.is_on()) << "a late failure must not start a search";
}

}  // namespace
}  // namespace docent::engine
