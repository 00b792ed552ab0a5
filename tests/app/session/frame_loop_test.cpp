// SPDX-License-Identifier: Apache-2.0
#include "app/session/frame_loop.h"

#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "app/session/camera_feed.h"
#include "app/simulator/simulation.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

// A live source of black images; an entry with a trouble sentence has no image.
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
    frame->image = trouble_.empty() ? cv::Mat(cv::Mat::zeros(120, 160, CV_8UC1)) : cv::Mat();
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

TEST(FrameLoop, ReportsImagesThatALiveSourceLostAsDropped) {
  const Played played = Play({{4, Timestamp(100), ""}, {5, Timestamp(200), ""}, {8, Timestamp(500), ""}});
  EXPECT_THAT(played.frames,
              ElementsAre(std::pair(4ul, kLost), std::pair(5ul, kLost), std::pair(6ul, kDropped),
                          std::pair(7ul, kDropped), std::pair(8ul, kLost)));
  EXPECT_THAT(played.times,
              ElementsAre(Timestamp(100), Timestamp(200), Timestamp(300), Timestamp(400), Timestamp(500)));
}

TEST(GapReporter, ReportsMissingImagesButNoneWhereTheIndexJumps) {
  GapReporter gaps;
  int dropped = 0;
  const std::vector<std::pair<std::uint64_t, int>> cases = {
      {0, 0}, {3, 2}, {3 + (std::uint64_t{1} << 31), 2}};
  for (const auto& [index, expected] : cases) {
    engine::Frame frame;
    frame.index = index;
    frame.time = FromSeconds(static_cast<double>(index));
    gaps.Report(frame, [&](const engine::TrackedFrame&) { ++dropped; });
    EXPECT_EQ(dropped, expected) << index;
  }
}

TEST(FrameLoop, ReportsTroubleOnceAndItsEndAndContinues) {
  const Played played = Play({{0, Timestamp(100), ""},
                              {1, Timestamp(200), "It was unplugged."},
                              {1, Timestamp(300), "It was unplugged."},
                              {1, Timestamp(900), ""}});
  EXPECT_THAT(played.troubles, ElementsAre("It was unplugged.", ""));
  EXPECT_THAT(played.frames, ElementsAre(std::pair(0ul, kLost), std::pair(1ul, kLost)));
}

// Two images that were taken in 2033, according to their times, of a source that takes one in two centuries.
class SlowSource : public FrameSource {
 public:
  SlowSource() {
    info_.name = "slow";
    info_.nominal_fps = 1.2e-10;
    info_.known_camera = SimulatedCamera(160);
  }
  bool Next(engine::Frame* frame) override {
    if (next_ == 2) return false;
    frame->index = next_;
    frame->time = std::chrono::seconds(2'000'000'000 + next_++);
    frame->image = cv::Mat::zeros(120, 160, CV_8UC1);
    return true;
  }

 private:
  std::uint64_t next_ = 0;
};

TEST(FrameLoop, EndsInEagerPaceWhateverTheRateOfTheImages) {
  CalibratedCamera camera = Calibrate(std::make_unique<SlowSource>(), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  FrameLoopOptions loop;
  loop.pace = Pace::kEager;
  int frames = 0;
  RunFrames(&camera, &session, loop, [&](const engine::TrackedFrame&) { ++frames; }, {});
  EXPECT_EQ(frames, 2);
}

// Delivers the images of a simulation, and is then disconnected for ten seconds.
class CameraThatIsUnplugged : public FrameSource {
 public:
  explicit CameraThatIsUnplugged(const std::shared_ptr<const Simulation>& simulation)
      : source_(OpenSimulation(simulation)) {
    info_ = source_->info();
  }
  bool Next(engine::Frame* frame) override {
    if (source_->Next(frame)) {
      last_ = frame->time;
      return true;
    }
    if (empty_ == kEmptyImages) return false;
    *frame = engine::Frame();
    frame->time = last_ + std::chrono::milliseconds(100) * ++empty_;
    return true;
  }
  std::string trouble() const override { return empty_ > 0 ? "It was unplugged." : ""; }

  static constexpr int kEmptyImages = 100;

 private:
  std::unique_ptr<FrameSource> source_;
  Timestamp last_{};
  int empty_ = 0;
};

TEST(FrameLoop, SavesWhatIsChangedWhileTheCameraIsDisconnected) {
  const auto simulation = simulated_session::Room(2.5);
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options = simulated_session::Options(Pace::kLockstep, "Bay");
  options.autosave_interval = std::chrono::seconds(1);
  Session session(options, simulated_session::LensOf(*simulation), &library);
  CalibratedCamera camera = Calibrate(std::make_unique<CameraThatIsUnplugged>(simulation), std::nullopt);
  CommandInbox inbox;
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  loop.inbox = &inbox;
  const auto is_saved = [&] {
    const auto maps = library.List();
    return !maps.empty() && library.LoadScene(maps.front().key).text.find("seen later") != std::string::npos;
  };
  int calls = 0;
  loop.disconnected = [&](const engine::TrackedFrame* last) {
    ASSERT_NE(last, nullptr);
    if (++calls == 1) inbox.Push({PlaceSignpost{"seen later", {320, 290}, ""}, nullptr});
    if (calls < CameraThatIsUnplugged::kEmptyImages) return;
    // The library is written on another thread.
    for (int i = 0; i < 6000 && !is_saved(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(is_saved());
  };
  RunFrames(&camera, &session, loop, [](const engine::TrackedFrame&) {}, {});
  EXPECT_EQ(calls, CameraThatIsUnplugged::kEmptyImages);
  session.Finish();
}

// A clock that advances only when the test says so.
class SteppedClock : public PlayClock {
 public:
  Timestamp Now() override { return now_; }
  void WaitUntil(Timestamp time, const std::stop_token&) override { now_ = std::max(now_, time); }
  void Pass(Timestamp time) { now_ += time; }

 private:
  Timestamp now_ = std::chrono::hours(5);
};

// A recording of black images, ten per second.
class Recording : public FrameSource {
 public:
  explicit Recording(std::uint64_t images) : images_(images) {
    info_.name = "recording";
    info_.nominal_fps = 10;
    info_.known_camera = SimulatedCamera(160);
  }
  bool Next(engine::Frame* frame) override {
    if (next_ == images_) return false;
    frame->index = next_;
    frame->time = std::chrono::milliseconds(100) * next_++;
    frame->image = cv::Mat::zeros(120, 160, CV_8UC1);
    return true;
  }

 private:
  const std::uint64_t images_;
  std::uint64_t next_ = 0;
};

TEST(FrameLoop, EndsWithOneSentenceAndTheLineOfACommandThatCannotBeCarriedOut) {
  const auto refusal = [](const Command& command) {
    CalibratedCamera camera = Calibrate(std::make_unique<Recording>(3), std::nullopt);
    Session session({}, {camera.model}, nullptr);
    FrameLoopOptions loop;
    loop.script = {{Timestamp{}, 4, command}};
    loop.script_name = "walk.txt";
    return ErrorOf([&] { RunFrames(&camera, &session, loop, [](const engine::TrackedFrame&) {}, {}); });
  };
  EXPECT_EQ(refusal(UseMap{"Desk"}), "walk.txt, line 4: there is no map 'Desk'.");
  EXPECT_EQ(refusal(NewMap{"a\nb"}),
            "walk.txt, line 4: a map's name must have 1 to 200 bytes and no control characters.");
  EXPECT_THAT(refusal(PlaceModel{"none.glb", {1, 2}, 1e12, 0}), AllOf(HasSubstr("line 4"), EndsWith(".")));
  EXPECT_THAT(refusal(PlaceModel{"none.glb", {1, 2}, 1e12, 0}), Not(EndsWith("..")));
}

TEST(FrameLoop, DropsLateImagesInRealtimeInsteadOfQueueingThem) {
  constexpr std::uint64_t kImages = 40;
  CalibratedCamera camera = Calibrate(std::make_unique<Recording>(kImages), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  SteppedClock clock;
  FrameLoopOptions loop;
  loop.pace = Pace::kRealtime;
  loop.clock = &clock;
  std::vector<Timestamp> latencies;
  loop.latency = [&](Timestamp latency) { latencies.push_back(latency); };
  std::vector<std::uint64_t> tracked, dropped, all;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              all.push_back(frame.frame.index);
              if (frame.state == kDropped) return dropped.push_back(frame.frame.index);
              tracked.push_back(frame.frame.index);
              // The callback takes two and a half frame periods for the first twenty images, then almost no
              // time.
              clock.Pass(std::chrono::milliseconds(frame.frame.index < 20 ? 250 : 1));
            },
            {});
  ASSERT_EQ(all.size(), kImages) << "every image is reported once";
  for (std::uint64_t i = 0; i < kImages; ++i) EXPECT_EQ(all[i], i) << "images are reported in order";
  // By hand: image 0 ends at 250 ms, when the successor of image 1 is due and that of image 2 is not.
  EXPECT_THAT(std::vector(tracked.begin(), tracked.begin() + 4), ElementsAre(0u, 2u, 4u, 7u));
  EXPECT_EQ(dropped.size(), 13u);
  for (const std::uint64_t index : dropped)
    EXPECT_LT(index, 23u) << "no image is dropped after the slow period";
  ASSERT_EQ(latencies.size(), tracked.size());
  for (const Timestamp latency : latencies) {
    EXPECT_GE(latency, Timestamp{});
    EXPECT_LE(latency, std::chrono::milliseconds(100)) << "the tracked image is the newest one";
  }
  EXPECT_EQ(latencies.back(), Timestamp{});
}

// Every image takes time to produce; late images need not be produced.
class SlowRecording : public Recording {
 public:
  SlowRecording(std::uint64_t images, SteppedClock* clock) : Recording(images), clock_(clock) {}
  bool Next(engine::Frame* frame) override {
    clock_->Pass(std::chrono::milliseconds(250));
    return Recording::Next(frame);
  }
  bool NextLate(engine::Frame* frame) override {
    if (!Recording::Next(frame)) return false;
    frame->image.release();
    return true;
  }

 private:
  SteppedClock* const clock_;
};

TEST(FrameLoop, TracksAsManySlowlyRenderedImagesAsPossibleInRealtime) {
  SteppedClock clock;
  CalibratedCamera camera = Calibrate(std::make_unique<SlowRecording>(30, &clock), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  FrameLoopOptions loop;
  loop.pace = Pace::kRealtime;
  loop.clock = &clock;
  Timestamp oldest{};
  loop.latency = [&](Timestamp latency) { oldest = std::max(oldest, latency); };
  std::vector<std::uint64_t> tracked, all;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              all.push_back(frame.frame.index);
              if (frame.state != kDropped) tracked.push_back(frame.frame.index);
            },
            {});
  ASSERT_EQ(all.size(), 30u);
  for (std::uint64_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], i);
  EXPECT_GE(tracked.size(), 11u) << "rendering one image takes two and a half frame periods";
  EXPECT_LE(oldest, std::chrono::milliseconds(350)) << "rendering time plus less than one frame period";
}

// Of all images but the first, none is in time.
TEST(FrameLoop, CarriesOutCommandsWhileAllImagesAreLate) {
  SteppedClock clock;
  CalibratedCamera camera = Calibrate(std::make_unique<SlowRecording>(20, &clock), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  CommandInbox inbox;
  FrameLoopOptions loop;
  loop.pace = Pace::kRealtime;
  loop.clock = &clock;
  loop.inbox = &inbox;
  std::uint64_t at = 0;
  std::vector<std::uint64_t> taken;
  loop.take = [&](const Command&, const engine::TrackedFrame&) {
    taken.push_back(at);
    return true;
  };
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              at = frame.frame.index;
              if (at == 0) clock.Pass(std::chrono::hours(1));
              if (at == 5 || at == 9) inbox.Push({GuideVisitor{}, nullptr});
              EXPECT_EQ(frame.state == kDropped, at > 0);
            },
            {});
  EXPECT_THAT(taken, ElementsAre(5u, 9u)) << "with the image after which they were given";
}

TEST(FrameLoop, CarriesOutWhatAPersonWantsJustBeforeQuitting) {
  for (const Pace pace : {Pace::kEager, Pace::kLockstep}) {
    CalibratedCamera camera = Calibrate(std::make_unique<Recording>(3), std::nullopt);
    SessionOptions options;
    options.may_write = false;
    options.threaded = pace != Pace::kLockstep;
    Session session(options, {camera.model}, nullptr);
    CommandInbox inbox;
    std::stop_source stopping;
    std::vector<std::uint64_t> taken;
    FrameLoopOptions loop;
    loop.pace = pace;
    loop.inbox = &inbox;
    loop.take = [&](const Command&, const engine::TrackedFrame& frame) {
      taken.push_back(frame.frame.index);
      return true;
    };
    RunFrames(
        &camera, &session, loop,
        [&](const engine::TrackedFrame& frame) {
          if (frame.frame.index != 1) return;
          inbox.Push({GuideVisitor{}, nullptr});
          stopping.request_stop();
        },
        stopping.get_token());
    EXPECT_THAT(taken, ElementsAre(1u)) << ToString(pace);
  }
}

// A surface of many triangles, which takes long to read.
std::string LargeModel() {
  constexpr int kSide = 300;
  std::string text;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) text += "v " + std::to_string(x) + " " + std::to_string(y) + " 0\n";
  }
  for (int i = 1; i + kSide + 1 <= kSide * kSide; ++i) {
    text += "f " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + kSide) + "\n";
  }
  return text;
}

TEST(FrameLoop, TracksOnWhileAFileThatIsToBePlacedIsRead) {
  const TemporaryFolder folder;
  folder.Write("large.obj", LargeModel());
  for (const Pace pace : {Pace::kEager, Pace::kRealtime, Pace::kLockstep}) {
    CalibratedCamera camera = Calibrate(std::make_unique<Recording>(6), std::nullopt);
    SessionOptions options;
    options.threaded = pace != Pace::kLockstep;
    Session session(options, {camera.model}, nullptr);
    CommandInbox inbox;
    FrameLoopOptions loop;
    loop.pace = pace;
    loop.inbox = &inbox;
    loop.model_folder = folder.path();
    std::vector<std::string> refused;
    loop.refused = [&](const std::string& reason) { refused.push_back(reason); };
    std::vector<std::pair<std::size_t, std::uint64_t>> taken;
    loop.take = [&](const Command& command, const engine::TrackedFrame& frame) {
      taken.emplace_back(command.index(), frame.frame.index);
      return true;
    };
    RunFrames(&camera, &session, loop,
              [&](const engine::TrackedFrame& frame) {
                if (frame.frame.index != 1) return;
                inbox.Push({PlaceModel{"large.obj", {1, 2}, std::nullopt, 0}, nullptr});
                inbox.Push({PlaceModel{"none.obj", {1, 2}, std::nullopt, 0}, nullptr});
                inbox.Push({Undo{}, nullptr});
              },
              {});
    ASSERT_GE(taken.size(), 2u) << ToString(pace);
    EXPECT_EQ(taken.front().first, Command(PlaceModel{}).index());
    EXPECT_EQ(taken.back().first, Command(Undo{}).index()) << "the commands keep their order";
    if (pace == Pace::kLockstep) {
      EXPECT_EQ(taken.front().second, 2u) << "what is done depends on the images alone";
    } else {
      EXPECT_GT(taken.front().second, 2u);
      EXPECT_EQ(taken.size(), 2u);
      EXPECT_THAT(refused, ElementsAre(HasSubstr("none.obj")));
    }
  }
}

TEST(FrameLoop, ReportsTheAgeOfALiveImageFromItsTimestamp) {
  SteppedClock clock;
  const Timestamp taken = clock.Now() - std::chrono::milliseconds(30);
  CalibratedCamera camera = Calibrate(
      std::make_unique<ScriptedSource>(std::vector<ScriptedSource::Entry>{{0, taken, ""}}), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  FrameLoopOptions loop;
  loop.pace = Pace::kRealtime;
  loop.clock = &clock;
  std::vector<Timestamp> latencies;
  loop.latency = [&](Timestamp latency) { latencies.push_back(latency); };
  RunFrames(&camera, &session, loop, [](const engine::TrackedFrame&) {}, {});
  EXPECT_THAT(latencies, ElementsAre(std::chrono::milliseconds(30)));
}

TEST(FrameLoop, ShowsARecordingNoFasterThanItsTimesWhereAPersonIsToFollow) {
  for (const Pace pace : {Pace::kEager, Pace::kLockstep}) {
    CalibratedCamera camera = Calibrate(std::make_unique<Recording>(3), std::nullopt);
    SessionOptions options;
    options.may_write = false;
    options.threaded = pace != Pace::kLockstep;
    Session session(options, {camera.model}, nullptr);
    FrameLoopOptions loop;
    loop.pace = pace;
    loop.no_faster_than_times = true;
    int shown = 0;
    const auto begin = std::chrono::steady_clock::now();
    RunFrames(&camera, &session, loop, [&](const engine::TrackedFrame&) { ++shown; }, {});
    EXPECT_EQ(shown, 3);
    EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(200)) << ToString(pace);
  }
}

TEST(FrameLoop, PausesWhileTheClockIsStoppedAndStaysAtTheLastImage) {
  CalibratedCamera camera = Calibrate(std::make_unique<Recording>(3), std::nullopt);
  SessionOptions options;
  options.may_write = false;
  Session session(options, {camera.model}, nullptr);
  PausableClock clock(true);
  CommandInbox inbox;
  std::stop_source stopping;
  std::vector<std::pair<std::uint64_t, bool>> idle;  // Index of the image, and whether it is the last one.
  std::vector<std::uint64_t> shown;
  std::vector<std::string> refused;
  FrameLoopOptions loop;
  loop.pace = Pace::kEager;
  loop.clock = &clock;
  loop.inbox = &inbox;
  loop.stays = true;
  loop.refused = [&](const std::string& reason) { refused.push_back(reason); };
  loop.idle = [&](const engine::TrackedFrame& frame, bool at_end) {
    idle.emplace_back(frame.frame.index, at_end);
    if (idle.size() == 1 || idle.size() == 3) inbox.Push({Undo{}, nullptr});
    if (idle.size() == 2) clock.Resume();
    if (idle.size() == 4) stopping.request_stop();
  };
  RunFrames(
      &camera, &session, loop, [&](const engine::TrackedFrame& frame) { shown.push_back(frame.frame.index); },
      stopping.get_token());
  EXPECT_THAT(shown, ElementsAre(0u, 1u, 2u));
  EXPECT_THAT(idle, ElementsAre(std::pair(0ul, false), std::pair(0ul, false), std::pair(2ul, true),
                                std::pair(2ul, true)));
  EXPECT_THAT(refused, ElementsAre(HasSubstr("read-only"), HasSubstr("read-only")))
      << "commands are carried out meanwhile";
}

TEST(FrameLoop, SavesNoMoreOftenAtTheEndWhereAnotherRecordingIsShorter) {
  const auto simulation = simulated_session::Room(4);
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options = simulated_session::Options(Pace::kLockstep, "Bay");
  options.autosave_interval = std::chrono::seconds(1);
  CalibratedCamera camera = simulated_session::CameraOf(simulation);
  CalibratedCamera shorter = Calibrate(std::make_unique<Recording>(3), std::nullopt);
  Session session(options, {camera.model, shorter.model}, &library);
  CommandInbox inbox;
  std::stop_source stopping;
  std::chrono::steady_clock::time_point begin;
  int turns = 0;
  std::vector<CameraRun> runs(2);
  for (CameraRun& run : runs) {
    run.options.pace = Pace::kLockstep;
    run.options.stays = true;
    run.options.idle = [](const engine::TrackedFrame&, bool) {};
    run.shown = [](const engine::TrackedFrame&) {};
  }
  runs[0].camera = &camera;
  runs[1].camera = &shorter;
  runs[1].options.camera = 1;
  runs[0].options.script.push_back({std::chrono::seconds(3), 1, PlaceSignpost{"here", {320, 290}, ""}});
  runs[0].options.inbox = &inbox;
  runs[0].options.idle = [&](const engine::TrackedFrame&, bool at_end) {
    if (!at_end) return;
    if (++turns == 1) {
      session.TakeEvents();
      begin = std::chrono::steady_clock::now();
    }
    inbox.Push({SetEntityText{"sign-1", std::to_string(turns)}, nullptr});
    if (turns == 30) stopping.request_stop();
  };
  RunCameras(runs, &session, stopping.get_token());
  const double passed_s = ToSeconds(std::chrono::steady_clock::now() - begin);
  EXPECT_EQ(turns, 30);
  int saves = 0;
  for (const Event& event : session.TakeEvents()) saves += event.event == "save";
  EXPECT_LE(saves, 2 + passed_s) << "one a second, although there is something to save each time";
  session.Finish();
}

TEST(PausableClock, JumpsToWhatIsWaitedForDuringFastForward) {
  PausableClock clock;
  const Timestamp begin = clock.Now();
  clock.SetFastForward(true);
  clock.WaitUntil(begin + std::chrono::hours(1), {});
  EXPECT_GE(clock.Now() - begin, std::chrono::hours(1));
  clock.SetFastForward(false);
  const Timestamp before = clock.Now();
  clock.WaitUntil(before + std::chrono::milliseconds(20), {});
  EXPECT_GE(clock.Now() - before, std::chrono::milliseconds(20)) << "it goes on from where it is";
  EXPECT_LT(clock.Now() - begin, std::chrono::hours(2));
}

TEST(PausableClock, LosesTheTimeForWhichItIsStopped) {
  using std::chrono::milliseconds;
  PausableClock clock(true);
  const Timestamp begin = clock.Now();
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_EQ(clock.Now(), begin);
  clock.WaitUntil(begin + std::chrono::hours(1), {});  // Returns, because nothing would end the wait.
  clock.Resume();
  const Timestamp resumed = PlayClock().Now();
  clock.WaitUntil(begin + milliseconds(20), {});
  EXPECT_GE(clock.Now(), begin + milliseconds(20));
  EXPECT_GE(PlayClock().Now() - resumed, milliseconds(15));
  clock.Stop();
  EXPECT_TRUE(clock.IsStopped());
}

}  // namespace
}  // namespace docent::app
