// SPDX-License-Identifier: Apache-2.0
#include "app/session/frame_loop.h"

#include <gmock/gmock.h>

#include "app/simulator/simulation.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;

// A live source of black pictures; an entry without a picture is a moment of trouble.
class ScriptedSource : public FrameSource {
 public:
  struct Entry {
    std::uint64_t index;
    Timestamp time;
    std::string trouble;
  };
  explicit ScriptedSource(std::vector<Entry> entries) : entries_(std::move(entries)) {
    info_.name = "scripted";
    info_.live = true;
    info_.known_camera = SimulatedCamera(160);
  }
  bool Next(engine::Frame* frame) override {
    if (next_ == entries_.size()) return false;
    const Entry& entry = entries_[next_++];
    trouble_ = entry.trouble;
    frame->index = entry.index;
    frame->time = entry.time;
    frame->picture = trouble_.empty() ? cv::Mat(cv::Mat::zeros(120, 160, CV_8UC1)) : cv::Mat();
    return true;
  }
  std::string trouble() const override { return trouble_; }

 private:
  std::vector<Entry> entries_;
  std::size_t next_ = 0;
  std::string trouble_;
};

struct Played {
  std::vector<std::pair<std::uint64_t, engine::TrackingState>> frames;
  std::vector<Timestamp> times;
  std::vector<std::string> troubles;
};

Played Play(std::vector<ScriptedSource::Entry> entries) {
  CalibratedCamera camera = Calibrate(std::make_unique<ScriptedSource>(std::move(entries)), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  FrameLoopOptions loop;
  Played played;
  loop.pace = Pace::kRealtime;
  loop.trouble = [&](const std::string& sentence, Timestamp) { played.troubles.push_back(sentence); };
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              played.frames.emplace_back(frame.frame.index, frame.state);
              played.times.push_back(frame.frame.time);
            },
            {});
  return played;
}

constexpr auto kLost = engine::TrackingState::kLost, kDropped = engine::TrackingState::kDropped;

TEST(FrameLoop, HandsOnWhatALiveSourceLostAsDropped) {
  const Played played = Play({{4, Timestamp(100), ""}, {5, Timestamp(200), ""}, {8, Timestamp(500), ""}});
  EXPECT_THAT(played.frames,
              ElementsAre(std::pair(4ul, kLost), std::pair(5ul, kLost), std::pair(6ul, kDropped),
                          std::pair(7ul, kDropped), std::pair(8ul, kLost)));
  EXPECT_THAT(played.times,
              ElementsAre(Timestamp(100), Timestamp(200), Timestamp(300), Timestamp(400), Timestamp(500)));
}

TEST(FrameLoop, TellsOfTroubleOnceAndOfItsEndAndGoesOn) {
  const Played played = Play({{0, Timestamp(100), ""},
                              {1, Timestamp(200), "It was unplugged."},
                              {1, Timestamp(300), "It was unplugged."},
                              {1, Timestamp(900), ""}});
  EXPECT_THAT(played.troubles, ElementsAre("It was unplugged.", ""));
  EXPECT_THAT(played.frames, ElementsAre(std::pair(0ul, kLost), std::pair(1ul, kLost)));
}

}  // namespace
}  // namespace docent::app
