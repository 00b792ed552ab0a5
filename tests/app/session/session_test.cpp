// SPDX-License-Identifier: Apache-2.0
#include "app/session/session.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <fstream>

#include "app/cameras/simulated_source.h"
#include "app/demo/exhibit_model.h"
#include "app/session/frame_loop.h"
#include "app/session/surface_at_pixel.h"
#include "app/simulator/simulation.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using namespace simulated_session;

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Session, MapsOnItsOwnThreadInTheEagerPaceAndDropsNothing) {
  const auto simulation = Room(3);
  Session session(Options(Pace::kEager, "map"), LensOf(*simulation), nullptr);
  const Seen seen = Feed(simulation, Pace::kEager, &session);
  EXPECT_EQ(seen.frames.size(), static_cast<std::size_t>(simulation->frame_count()));
  EXPECT_GT(seen.poses, simulation->frame_count() / 2);
  const auto maps = session.Maps();
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_GT(maps[0].snapshot->keyframes.size(), 2u);
  EXPECT_EQ(engine::Validate(*maps[0].snapshot), "");
}

TEST(Session, KeepsWhatIsPlacedUndoneAndRedoneInTheLibrary) {
  const auto simulation = Room(4);
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  folder.Write("exhibit.glb", {glb.begin(), glb.end()});
  {
    maps::Library library =
        maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    Session session(Options(Pace::kLockstep, ""), LensOf(*simulation), &library);
    const auto at = [](double seconds, Command command) {
      return TimedCommand{FromSeconds(seconds), 1, std::move(command)};
    };
    const Eigen::Vector2d pixel(320, 290);
    Feed(simulation, Pace::kLockstep, &session,
         {at(0, NewMap{"Desk"}), at(3, PlaceModel{"exhibit.glb", pixel, 0.3, 20}),
          at(3, PlaceSignpost{"here", pixel, ""}), at(3.1, ScaleEntity{"exhibit", 2}), at(3.2, Undo{}),
          at(3.3, Undo{}), at(3.4, Redo{}), at(3.5, SetPolicy{"Desk", maps::Policy::kAugmentOnly}),
          at(3.6, PlaceSignpost{"there", pixel, ""})},
         folder.path());
  }
  maps::Library library = maps::Library::Open(folder / "l.docent", maps::Access::kReadOnly);
  EXPECT_THAT(library.Verify(), IsEmpty());
  const maps::MapInfo info = library.FindByName("Desk");
  EXPECT_EQ(info.policy, maps::Policy::kAugmentOnly);
  SessionOptions tour;
  tour.may_write = false;
  Session session(tour, LensOf(*simulation), &library);
  const auto maps = session.Maps();
  ASSERT_EQ(maps.size(), 1u);
  ASSERT_EQ(maps[0].scene->entities.size(), 3u);
  EXPECT_EQ(maps[0].scene->Find("exhibit")->model.map_from_model.scale, 0.3);
  EXPECT_EQ(maps[0].scene->Find("sign-2")->signpost.text, "there");
  EXPECT_THAT(ErrorOf([&] { session.Execute(NewMap{"More"}, {}); }), HasSubstr("tour"));
  const std::uint64_t keyframes = info.keyframes;
  const auto visit = Room(1.5);
  const Seen seen = Feed(visit, Pace::kEager, &session);
  EXPECT_GT(seen.poses, visit->frame_count() / 3);

  // The same when maps are loaded on demand: when the camera recognizes them, or by name.
  tour.memory.read_at_start_bytes = 0;
  Session seeing(tour, LensOf(*simulation), &library), naming(tour, LensOf(*simulation), &library);
  EXPECT_EQ(seeing.Maps().at(0).snapshot, nullptr);
  EXPECT_EQ(Feed(visit, Pace::kEager, &seeing).poses, seen.poses);
  EXPECT_EQ(seeing.Maps().at(0).scene->entities.size(), 3u);
  naming.Execute(UseMap{"Desk"}, {});
  EXPECT_NE(naming.Maps().at(0).snapshot, nullptr);
  EXPECT_EQ(library.FindByName("Desk").keyframes, keyframes);
}

// A camera that only rotates gives a map without finite points, in which nothing can be placed.
TEST(Session, NeverSavesAMapWithoutFinitePoints) {
  const auto simulation = std::shared_ptr<const Simulation>(MakeSimulation("cylinder:0"));
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options = Options(Pace::kLockstep, "Turn");
  options.autosave_interval = std::chrono::milliseconds(200);
  Session session(options, LensOf(*simulation), &library);
  const Seen seen = Feed(simulation, Pace::kLockstep, &session);
  EXPECT_GT(seen.poses, simulation->frame_count() * 9 / 10);
  const auto maps = session.Maps();
  ASSERT_EQ(maps.size(), 1u);
  ASSERT_NE(maps[0].snapshot, nullptr);
  EXPECT_GT(maps[0].snapshot->keyframes.size(), 3u);
  EXPECT_FALSE(maps[0].snapshot->HasFinitePoints());
  EXPECT_THAT(library.List(), IsEmpty());
  for (const Event& event : session.TakeEvents()) EXPECT_NE(event.event, "save") << event.detail;
}

// Any image can start a panorama map, so the session does not wait before it starts again.
TEST(Session, StartsAgainWithTheNextImageWhenTheFirstIsLost) {
  const auto simulation = Room(1);
  const auto source = OpenSimulation(simulation);
  engine::Frame first;
  ASSERT_TRUE(source->Next(&first));
  SessionOptions options = Options(Pace::kLockstep, "Bay");
  Session session(options, LensOf(*simulation), nullptr);
  const auto frame_of = [&](std::uint64_t index) {
    engine::Frame frame = first;
    frame.index = index;
    frame.time = FromSeconds(static_cast<double>(index) / 30);
    const bool dark = index >= 3 && index < 10;
    if (dark) frame.image = cv::Mat(first.image.size(), first.image.type(), cv::Scalar::all(0));
    return frame;
  };
  std::vector<engine::TrackingState> states;
  for (std::uint64_t i = 0; i < 14; ++i) states.push_back(session.Process(frame_of(i)).state);
  EXPECT_EQ(states[2], engine::TrackingState::kPanorama);
  EXPECT_EQ(states[5], engine::TrackingState::kLost);
  EXPECT_EQ(states[9], engine::TrackingState::kInitializing);
  EXPECT_EQ(states[13], engine::TrackingState::kPanorama);
  std::vector<std::string> discarded;
  for (const Event& event : session.TakeEvents())
    if (event.detail.find("discarded") != std::string::npos) discarded.push_back(event.detail);
  ASSERT_EQ(discarded.size(), 1u);
  EXPECT_THAT(discarded[0], HasSubstr("before the map had finite points"));
  const auto maps = session.Maps();
  const auto ended =
      std::find_if(maps.begin(), maps.end(), [](const Session::MapState& map) { return map.discarded; });
  ASSERT_NE(ended, maps.end());
  ASSERT_FALSE(ended->snapshot->keyframes.empty()) << "a report counts them";
  EXPECT_TRUE(ended->snapshot->keyframes[0].features->levels[0].empty()) << "its images are kept in memory";
}

TEST(Session, LeavesNoSignpostToAMapThatWasNeverInitialized) {
  const auto simulation = Room(4);
  Session session(Options(Pace::kLockstep, "Desk"), LensOf(*simulation), nullptr);
  const Eigen::Vector2d pixel(320, 290);
  const auto at_3_s = [](Command command) { return TimedCommand{FromSeconds(3), 1, std::move(command)}; };
  Feed(simulation, Pace::kLockstep, &session,
       {at_3_s(NewMap{"Annex"}), at_3_s(PlaceSignpost{"this way", pixel, "Annex"}), at_3_s(UseMap{"Desk"})});
  const auto maps = session.Maps();
  ASSERT_EQ(maps.size(), 1u) << "no image has started the other map";
  ASSERT_EQ(maps[0].scene->entities.size(), 1u);
  EXPECT_EQ(maps[0].scene->entities[0].signpost.to_key, 0u);
  EXPECT_EQ(maps[0].scene->entities[0].signpost.to_map, "");
}

// One author's session in lockstep and the library that it saved; the tests do not change them.
class AuthoredBay : public ::testing::Test {
 protected:
  struct Run {
    TemporaryFolder folder;
    Seen seen;
  };
  static void SetUpTestSuite() {
    run_ = new Run;
    const auto simulation = Room(4);
    maps::Library library =
        maps::Library::Open(run_->folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    SessionOptions options = Options(Pace::kLockstep, "Bay");
    Session session(options, LensOf(*simulation), &library);
    run_->seen = Feed(simulation, Pace::kLockstep, &session);
  }
  static void TearDownTestSuite() {
    delete run_;
    run_ = nullptr;
  }
  static maps::Library Library() {
    return maps::Library::Open(run_->folder / "l.docent", maps::Access::kReadOnly);
  }

  static Run* run_;
};
AuthoredBay::Run* AuthoredBay::run_ = nullptr;

TEST_F(AuthoredBay, IsSavedOnceItHasFinitePointsAlthoughItBeganAsAPanorama) {
  const Seen& seen = run_->seen;
  ASSERT_GT(seen.frames.size(), 2u);
  EXPECT_EQ(seen.frames[1].state, engine::TrackingState::kPanorama);
  EXPECT_EQ(seen.frames[1].map_key, seen.frames.back().map_key);
  const maps::Library library = Library();
  ASSERT_EQ(library.List().size(), 1u);
  const auto saved = library.Load(library.FindByName("Bay").key).snapshot;
  EXPECT_TRUE(saved->HasFinitePoints());
  EXPECT_FALSE(saved->panoramas.empty());
  EXPECT_EQ(engine::Validate(*saved), "");
}

TEST_F(AuthoredBay, IsTrackedWithEqualPosesOnEveryRunInLockstep) {
  const auto simulation = Room(2.5);
  SessionOptions options = Options(Pace::kLockstep, "Bay");
  Session session(options, LensOf(*simulation), nullptr);
  const Seen again = Feed(simulation, Pace::kLockstep, &session);
  ASSERT_GT(again.poses, 10);
  ASSERT_LT(again.frames.size(), run_->seen.frames.size());
  for (std::size_t i = 0; i < again.frames.size(); ++i) {
    const engine::TrackedFrame &a = run_->seen.frames[i], &b = again.frames[i];
    ASSERT_EQ(a.state, b.state) << i;
    EXPECT_EQ(a.camera_from_map.translation, b.camera_from_map.translation) << i;
    EXPECT_EQ(a.camera_from_map.rotation.quaternion().coeffs(),
              b.camera_from_map.rotation.quaternion().coeffs())
        << i;
  }
}

TEST_F(AuthoredBay, GivesAVisitorElsewhereTheRejectionReasonWithFewEvents) {
  maps::Library library = Library();
  ASSERT_EQ(library.List().size(), 1u);
  SimulationOptions elsewhere;
  elsewhere.duration_s = 2.5;
  const std::shared_ptr<const Simulation> other = MakeSimulation("room", elsewhere);
  SessionOptions options = Options(Pace::kLockstep, "");
  options.may_write = false;
  Session session(options, LensOf(*other), &library);
  const Seen seen = Feed(other, Pace::kLockstep, &session);
  EXPECT_EQ(seen.poses, 0);
  int reported = 0;
  for (const Event& event : session.TakeEvents()) reported += event.event == "rejected";
  EXPECT_GE(reported, 1);
  EXPECT_LE(reported, 3);
  EXPECT_THAT(session.ShownWith(seen.frames.back()).hint,
              AnyOf(HasSubstr("recognize"), HasSubstr("resembles"), HasSubstr("shows"), HasSubstr("could be"),
                    HasSubstr("Probably")));
}

TEST(Session, RefusesACommandThatCannotBeExecutedAndNamesItsLine) {
  const auto simulation = Room(0.5);
  const auto refusal = [&](Command command) {
    Session session(Options(Pace::kLockstep, ""), LensOf(*simulation), nullptr);
    return ErrorOf([&] {
      Feed(simulation, Pace::kLockstep, &session, {{FromSeconds(0.1), 7, std::move(command)}});
    });
  };
  EXPECT_THAT(refusal(StopMap{}), HasSubstr("script, line 7: there is no current map"));
  EXPECT_THAT(refusal(UseMap{"Attic"}), HasSubstr("there is no map 'Attic'"));
  EXPECT_THAT(refusal(Undo{}), HasSubstr("no current map"));
  EXPECT_THAT(refusal(Save{}), HasSubstr("no library"));
  EXPECT_THAT(refusal(GuideVisitor{}), HasSubstr("docent tour"));
  EXPECT_THAT(refusal(PlaceModel{"missing.glb", {1, 1}, 1, 0}), HasSubstr("line 7"));
}

// Simulates a full disk: no file can grow beyond 4096 bytes while one of these exists.
class NoRoom {
 public:
  NoRoom() : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &limit_);
    const rlimit none{4096, limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &none);
  }
  ~NoRoom() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, handler_);
  }
  NoRoom(const NoRoom&) = delete;
  NoRoom& operator=(const NoRoom&) = delete;

 private:
  void (*handler_)(int);
  rlimit limit_{};
};

TEST(Session, WarnsWhileTheDiskIsFullAndSavesEverythingLater) {
  const auto simulation = Room(4);
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options = Options(Pace::kLockstep, "Desk");
  options.autosave_interval = options.provisional.time = std::chrono::milliseconds(200);
  Session session(options, LensOf(*simulation), &library);
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  std::optional<NoRoom> full;
  bool has_warned = false;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              if (ToSeconds(frame.frame.time) > 1.4 && !full && !has_warned) full.emplace();
              for (const Event& event : session.TakeEvents())
                has_warned =
                    has_warned || (event.event == "warning" &&
                                   event.detail.find("cannot be read or written") != std::string::npos);
              if (has_warned) full.reset();
            },
            {});
  full.reset();
  session.Finish();
  EXPECT_TRUE(has_warned);
  const maps::StoredMap stored = library.Load(library.FindByName("Desk").key);
  EXPECT_EQ(stored.snapshot->keyframes.size(), session.Maps().at(0).snapshot->keyframes.size());
  EXPECT_EQ(stored.info.revision, session.Maps().at(0).snapshot->revision);
  EXPECT_THAT(library.Verify(), IsEmpty());
}

TEST(Session, ReportsAFailedSaveAtTheEndAndKeepsEarlierSaves) {
  const auto simulation = Room(2.5);
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options = Options(Pace::kLockstep, "Desk");
  options.autosave_interval = options.provisional.time = std::chrono::milliseconds(200);
  Session session(options, LensOf(*simulation), &library);
  std::optional<NoRoom> full;
  bool is_submitted = false;
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              for (const Event& event : session.TakeEvents())
                is_submitted = is_submitted || event.event == "save";
              if (ToSeconds(frame.frame.time) <= 1.8 || !is_submitted || full || HasFatalFailure()) return;
              ASSERT_TRUE(WaitUntil([&] { return !library.List().empty(); }))
                  << "the saver has its own thread";
              full.emplace();
            },
            {});
  ASSERT_TRUE(full);
  EXPECT_THAT(ErrorOf([&] { session.Finish(); }),
              AllOf(HasSubstr("l.docent"), EndsWith(". Lost: the last changes of the map 'Desk'.")));
  full.reset();
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_GE(library.Load(library.FindByName("Desk").key).snapshot->keyframes.size(), 2u);
}

TEST(Session, NamesAMapThatWasNeverSavedAtTheEnd) {
  const auto simulation = Room(2.5);
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options = Options(Pace::kLockstep, "Desk");
  options.autosave_interval = {};  // only at the end
  Session session(options, LensOf(*simulation), &library);
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  RunFrames(&camera, &session, loop, [](const engine::TrackedFrame&) {}, {});
  ASSERT_TRUE(library.List().empty());
  NoRoom full;
  EXPECT_THAT(ErrorOf([&] { session.Finish(); }), EndsWith(". Lost: the map 'Desk'."));
}

}  // namespace
}  // namespace docent::app
