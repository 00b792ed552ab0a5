// SPDX-License-Identifier: Apache-2.0
#include "app/session/untracked_images.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <semaphore>
#include <stdexcept>

#include "app/session/guided_view.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;

// A recording of small images, ten per second.
class TenPerSecond : public FrameSource {
 public:
  explicit TenPerSecond(std::uint64_t images) : images_(images) { info_.nominal_fps = 10; }
  bool Next(engine::Frame* frame) override {
    if (!NextLate(frame)) return false;
    frame->image = cv::Mat::zeros(12, 16, CV_8UC1);
    return true;
  }
  bool NextLate(engine::Frame* frame) override {
    if (next_ == images_) {
      asked_beyond_end.release();
      return false;
    }
    frame->index = next_;
    frame->time = TimeOf(next_++);
    return true;
  }
  std::optional<Timestamp> NextTime() const override { return TimeOf(next_); }

  std::counting_semaphore<> asked_beyond_end{0};

 private:
  static Timestamp TimeOf(std::uint64_t index) {
    return std::chrono::milliseconds(100) * static_cast<std::int64_t>(index);
  }

  const std::uint64_t images_;
  std::uint64_t next_ = 0;
};

// A clock whose time passes only when it is waited for.
class WaitedClock : public PlayClock {
 public:
  Timestamp Now() override { return now_.load(); }
  void WaitUntil(Timestamp time, const std::stop_token&) override { now_ = std::max(now_.load(), time); }
  void Pass(Timestamp time) { now_ = now_.load() + time; }

 private:
  std::atomic<Timestamp> now_ = Timestamp(std::chrono::hours(5));
};

struct SlowTracking {
  explicit SlowTracking(std::uint64_t count) : source(count) {
    clock.Start(Timestamp{});
    engine::Frame first;
    source.Next(&first);
  }

  // Works until this many images were shown.
  void WorkDuring(int count) {
    images.During(
        [&] {
          for (int i = 0; i < count; ++i) shown.acquire();
        },
        std::chrono::nanoseconds(0), Timestamp{}, Timestamp{});
  }
  std::vector<std::uint64_t> Fetched() {
    std::vector<std::uint64_t> fetched;
    for (const engine::Frame& frame : images.TakeFetched()) {
      EXPECT_TRUE(frame.image.empty());
      fetched.push_back(frame.index);
    }
    return fetched;
  }

  TenPerSecond source;
  WaitedClock machine;
  RealtimeClock clock{&machine};
  std::counting_semaphore<> shown{0};
  std::vector<std::uint64_t> indices;
  UntrackedImages images{&source, &clock, 1, [this](const engine::Frame& frame) {
                           EXPECT_EQ(frame.camera, 1);
                           EXPECT_FALSE(frame.image.empty());
                           indices.push_back(frame.index);
                           shown.release();
                         }};
};

TEST(UntrackedImages, ShowsImagesOneAfterTheOtherWhileTheWorkGoesOn) {
  SlowTracking tracking(100);
  tracking.WorkDuring(3);
  // A fourth one may have come before the work was seen to be done.
  ASSERT_GE(tracking.indices.size(), 3u);
  tracking.indices.resize(3);
  EXPECT_THAT(tracking.indices, ElementsAre(1, 2, 3));
  auto fetched = tracking.Fetched();
  ASSERT_GE(fetched.size(), 3u);
  fetched.resize(3);
  EXPECT_THAT(fetched, ElementsAre(1, 2, 3));
  EXPECT_TRUE(tracking.Fetched().empty());
}

TEST(UntrackedImages, PassesOverImagesThatAreLate) {
  SlowTracking tracking(100);
  tracking.machine.Pass(std::chrono::milliseconds(550));
  tracking.WorkDuring(1);
  // At 550 ms the images until 400 ms are late by more than a period.
  ASSERT_FALSE(tracking.indices.empty());
  EXPECT_EQ(tracking.indices.front(), 5u);
  auto fetched = tracking.Fetched();
  ASSERT_GE(fetched.size(), 5u);
  fetched.resize(5);
  EXPECT_THAT(fetched, ElementsAre(1, 2, 3, 4, 5));
}

TEST(UntrackedImages, FetchesNothingDuringShortWork) {
  SlowTracking tracking(100);
  tracking.images.During([] {}, std::chrono::hours(1), Timestamp{}, Timestamp{});
  EXPECT_TRUE(tracking.Fetched().empty());
  EXPECT_TRUE(tracking.indices.empty());
  EXPECT_FALSE(tracking.images.has_ended());
}

TEST(UntrackedImages, NoticesTheEndOfTheSource) {
  SlowTracking tracking(2);
  tracking.images.During(
      [&] {
        tracking.shown.acquire();
        tracking.source.asked_beyond_end.acquire();
      },
      std::chrono::nanoseconds(0), Timestamp{}, Timestamp{});
  EXPECT_THAT(tracking.indices, ElementsAre(1));
  EXPECT_TRUE(tracking.images.has_ended());
}

TEST(UntrackedImages, RethrowsTheExceptionOfTheWork) {
  SlowTracking tracking(100);
  const auto fails = [] { throw std::runtime_error("no"); };
  EXPECT_THROW(tracking.images.During(fails, std::chrono::nanoseconds(0), Timestamp{}, Timestamp{}),
               std::runtime_error);
  tracking.WorkDuring(1);
  EXPECT_FALSE(tracking.indices.empty());
}

TEST(ShowWithoutPose, KeepsWhatIsSaidAndLeavesOutWhatNeedsAPose) {
  ShownFrame frame;
  frame.seconds = 3;
  frame.tracked.frame.time = std::chrono::milliseconds(3000);
  frame.tracked.state = engine::TrackingState::kSixDof;
  frame.tracked.matches.resize(2);
  frame.held_camera_from_map.emplace();
  frame.shown.scene = std::make_shared<content::Scene>();
  frame.message = "It was unplugged.";
  frame.visitor.emplace();
  frame.visitor->place = "Lions";
  frame.visitor->way_on.emplace();
  frame.visitor->targets.resize(1);
  frame.visitor->marked = 0;
  engine::Frame image;
  image.time = std::chrono::milliseconds(3400);
  image.image = cv::Mat::zeros(12, 16, CV_8UC1);
  ShowWithoutPose(image, &frame);
  EXPECT_EQ(frame.tracked.frame.image.data, image.image.data);
  EXPECT_FALSE(engine::HasPose(frame.tracked.state));
  EXPECT_TRUE(frame.tracked.matches.empty());
  EXPECT_FALSE(frame.held_camera_from_map);
  EXPECT_EQ(frame.shown.scene, nullptr);
  EXPECT_FALSE(frame.visitor->way_on);
  EXPECT_TRUE(frame.visitor->targets.empty());
  EXPECT_FALSE(frame.visitor->marked);
  EXPECT_NEAR(frame.seconds, 3.4, 1e-9);
  EXPECT_EQ(frame.message, "It was unplugged.");
  EXPECT_EQ(frame.visitor->place, "Lions");
}

}  // namespace
}  // namespace docent::app
