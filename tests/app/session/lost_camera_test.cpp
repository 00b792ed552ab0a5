// SPDX-License-Identifier: Apache-2.0
// What a session does with a lost camera that recognizes no map.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/app/support/simulated_session.h"

namespace docent::app {
namespace {

using namespace simulated_session;

// One place, then abruptly another one, with the same lens; and optionally the first one again.
class TwoPlaces : public FrameSource {
 public:
  TwoPlaces(double seconds, bool back) {
    SimulationOptions options;
    options.duration_s = seconds;
    first_ = MakeSimulation("museum:2", options);
    options.camera = first_->camera();
    options.seed = 9;
    second_ = MakeSimulation("room", options);
    info_.name = "two places";
    info_.known_camera = first_->camera();
    order_ = {first_, second_};
    if (back) order_.push_back(first_);
  }
  bool Next(engine::Frame* frame) override {
    if (part_ < order_.size() && frame_ == order_[part_]->frame_count()) {
      ++part_;
      frame_ = 0;
    }
    if (part_ == order_.size()) return false;
    order_[part_]->Render(frame_++, &frame->image);
    frame->image = frame->image.clone();
    frame->index = index_++;
    frame->time = FromSeconds(static_cast<double>(frame->index) / 30);
    return true;
  }

 private:
  std::shared_ptr<const Simulation> first_, second_;
  std::vector<std::shared_ptr<const Simulation>> order_;
  std::size_t part_ = 0;
  int frame_ = 0;
  std::uint64_t index_ = 0;
};

SourceRun VisitTwoPlaces(bool new_map, bool back) {
  SessionOptions options = Options(Pace::kLockstep, "Hall");
  options.new_map_when_lost = new_map;
  constexpr double kSeconds = 3;
  return RunSource(std::make_unique<TwoPlaces>(kSeconds, back), Pace::kLockstep, options, nullptr);
}

bool LastHasPose(const SourceRun& outcome) {
  return engine::HasPose(outcome.frames.back().state);
}

TEST(LostCamera, StartsANewMapInAnUnknownPlace) {
  const SourceRun outcome = VisitTwoPlaces(/*new_map=*/true, /*back=*/false);
  ASSERT_EQ(outcome.maps.size(), 2u);
  EXPECT_EQ(outcome.maps[0].name, "Hall");
  EXPECT_EQ(outcome.maps[1].name, "Hall 2");
  EXPECT_TRUE(LastHasPose(outcome));
  EXPECT_EQ(outcome.frames.back().map_key, outcome.maps[1].key);
  const auto lost =
      std::count_if(outcome.frames.begin(), outcome.frames.end(),
                    [](const engine::TrackedFrame& frame) { return !engine::HasPose(frame.state); });
  EXPECT_LT(lost, 25) << "of " << outcome.frames.size()
                      << " frames; the time before a new map is started is at least 6 of them";
}

TEST(LostCamera, WaitsWhenNewMapsAreDisabled) {
  const SourceRun outcome = VisitTwoPlaces(/*new_map=*/false, /*back=*/false);
  ASSERT_EQ(outcome.maps.size(), 1u);
  EXPECT_FALSE(LastHasPose(outcome));
}

TEST(LostCamera, ReturnsToTheFirstMapWhenItSeesItAgain) {
  const SourceRun outcome = VisitTwoPlaces(/*new_map=*/true, /*back=*/true);
  ASSERT_GE(outcome.maps.size(), 1u);
  EXPECT_TRUE(LastHasPose(outcome));
  EXPECT_EQ(outcome.frames.back().map_key, outcome.maps[0].key);
}

}  // namespace
}  // namespace docent::app
