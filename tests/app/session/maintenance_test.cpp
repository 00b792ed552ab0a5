// SPDX-License-Identifier: Apache-2.0
// What a session does for idle maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <future>
#include <mutex>
#include <thread>

#include "app/session/library_scene.h"
#include "app/session/maintenance_order.h"
#include "app/session/session_map.h"
#include "content/asset.h"
#include "engine/base/random.h"
#include "engine/vision/features.h"
#include "maps/maintenance/maintenance.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/maps/map_samples.h"

namespace docent::app {
namespace {

using namespace simulated_session;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// The map of a short walk, made once.
std::shared_ptr<const engine::MapSnapshot> WalkedMap() {
  static const auto map = [] {
    const auto simulation = Room(3);
    Session session(Options(Pace::kLockstep, "map"), LensOf(*simulation), nullptr);
    Feed(simulation, Pace::kLockstep, &session);
    return session.Maps().at(0).snapshot;
  }();
  return map;
}

// The same map with random offsets of up to `by` map units along x and y on its points.
std::shared_ptr<const engine::MapSnapshot> Crooked(double by) {
  auto map = std::make_shared<engine::MapSnapshot>(*WalkedMap());
  Random random(5);
  for (engine::MapPoint& point : map->points) {
    if (!point.infinite())
      point.point_in_map.head<3>() += by * Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), 0);
  }
  return map;
}

TEST(MaintenanceOrder, PrefersChangedMapsAndThenTheLargestReprojectionError) {
  const std::atomic<bool> go_on = false, interrupt = true;
  const IdleMap good{1, "good", Crooked(0.0005), false}, bad{2, "bad", Crooked(0.004), false},
      changed{3, "changed", Crooked(0.001), true}, changed_worse{4, "worse", Crooked(0.002), true};
  MaintenanceOrder order;
  EXPECT_EQ(order.Next({good, bad, changed, changed_worse}, go_on)->name, "worse");
  EXPECT_EQ(order.Next({good, bad, changed}, go_on)->name, "changed");
  EXPECT_EQ(order.Next({good, bad}, go_on)->name, "bad");
  // A new revision of a map is evaluated again.
  auto better = std::make_shared<engine::MapSnapshot>(*Crooked(0.0001));
  better->revision = bad.snapshot->revision + 1;
  EXPECT_EQ(order.Next({good, {2, "bad", better, false}}, go_on)->name, "good");
  EXPECT_FALSE(order.Next({}, go_on));
  EXPECT_FALSE(order.Next({good}, interrupt));
}

// A library with two perturbed maps, one of which may not be changed.
class IdleMaps : public ::testing::Test {
 protected:
  IdleMaps() {
    auto library = maps::Library::Open(file_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const auto& [name, policy] :
         {std::pair{"Open", maps::Policy::kOpen}, std::pair{"Fixed", maps::Policy::kReadOnly}})
      library.Save({library.NewKey(), name, policy, Crooked(0.01), nullptr});
  }
  double RmsOf(const maps::Library& library, const std::string& name) const {
    const auto map = library.Load(library.FindByName(name).key).snapshot;
    return maps::ReprojectionRms(*map, *map);
  }
  static std::vector<std::string> MaintenanceDetails(Session* session) {
    std::vector<std::string> details;
    for (const Event& event : session->TakeEvents()) {
      if (event.event == "maintenance") details.push_back(event.detail);
    }
    return details;
  }
  // Waits for maintenance to finish a map; two minutes at most, as the machine may be slow.
  static std::vector<std::string> AwaitMaintenance(Session* session) {
    std::vector<std::string> done;
    for (int i = 0; i < 6000 && done.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      done = MaintenanceDetails(session);
    }
    return done;
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
};

TEST_F(IdleMaps, AreAdjustedWhileTheSessionIsIdle) {
  const auto simulation = Room(1);
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
  const double before = RmsOf(library, "Open");
  Session session(Options(Pace::kEager, ""), LensOf(*simulation), &library);
  const std::vector<std::string> done = AwaitMaintenance(&session);
  ASSERT_EQ(done.size(), 1u);
  EXPECT_THAT(done[0], HasSubstr("Open: "));
  session.Finish();
  EXPECT_LT(RmsOf(library, "Open"), 0.5 * before);
  EXPECT_DOUBLE_EQ(RmsOf(library, "Fixed"), before);
  EXPECT_THAT(library.Verify(), IsEmpty());
  // The session has in memory what was saved.
  const auto maps = session.Maps();
  const auto open =
      std::find_if(maps.begin(), maps.end(), [](const auto& map) { return map.name == "Open"; });
  ASSERT_NE(open, maps.end());
  EXPECT_EQ(open->snapshot->revision, library.FindByName("Open").revision);
}

content::Scene SignOfMaintenance(const std::string& text) {
  content::Scene scene;
  content::Entity sign;
  sign.name = "sign-1";
  sign.signpost.text = text;
  sign.signpost.anchor = {0, 0, 1};
  scene.entities.push_back(sign);
  return scene;
}

// The anchors of the other program's content would move without it.
TEST_F(IdleMaps, AreNotAdjustedWhenAnotherProgramHasChangedTheirContent) {
  const auto simulation = Room(1);
  const auto save = [](maps::Library* library, std::uint64_t key, const std::string& text) {
    library->Save({key, "", maps::Policy::kOpen, nullptr,
                   std::make_shared<maps::SceneRecord>(RecordFromScene(SignOfMaintenance(text)))});
  };
  auto other = maps::Library::Open(file_, maps::Access::kReadWrite);
  const std::uint64_t open = other.FindByName("Open").key, less = other.NewKey();
  save(&other, open, "ours");
  other.Save({less, "Less", maps::Policy::kOpen, Crooked(0.003), nullptr});
  const auto before = other.Load(open).snapshot;
  // The other program saves while the session reads the images, after its transaction has begun.
  std::once_flag once;
  maps::LibraryOptions options;
  options.load_threads = 1;
  options.make_features = [&](const cv::Mat& gray) {
    std::call_once(once, [&] { save(&other, open, "theirs"); });
    return engine::MakeFeatures(gray);
  };
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite, maps::CreateIfMissing::kNo, options);
  Session session(Options(Pace::kEager, ""), LensOf(*simulation), &library);
  const auto maps = session.Maps();
  ASSERT_EQ(maps.at(0).key, open);
  ASSERT_EQ(maps.at(0).scene->entities.at(0).signpost.text, "ours");
  // The map with the larger error comes first.
  const std::vector<std::string> done = AwaitMaintenance(&session);
  session.Finish();
  ASSERT_EQ(done.size(), 1u);
  EXPECT_THAT(done[0], HasSubstr("Less: "));
  EXPECT_EQ(library.FindByName("Open").revision, before->revision);
  EXPECT_THAT(library.LoadScene(open).text, HasSubstr("theirs"));
}

// A map with damaged content stays as it is, because what cannot be read would be stored no more.
TEST_F(IdleMaps, KeepContentThatCannotBeRead) {
  const auto simulation = Room(1);
  std::uint64_t open = 0;
  {
    auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
    open = library.FindByName("Open").key;
    content::Scene scene = SignOfMaintenance("here");
    content::Entity fox;
    fox.kind = content::Entity::Kind::kModel;
    fox.name = "fox";
    fox.model.asset = std::make_shared<content::Asset>(
        content::ImportAsset(folder_.Write("fox.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")));
    scene.entities.push_back(fox);
    library.Save({open, "", maps::Policy::kOpen, nullptr,
                  std::make_shared<maps::SceneRecord>(RecordFromScene(scene))});
    library.Save({library.NewKey(), "Less", maps::Policy::kOpen, Crooked(0.003), nullptr});
  }
  maps::RunSql(file_, "UPDATE assets SET data = zeroblob(length(data))");
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
  Session session(Options(Pace::kEager, ""), LensOf(*simulation), &library);
  const std::vector<std::string> done = AwaitMaintenance(&session);
  session.Finish();
  ASSERT_EQ(done.size(), 1u);
  EXPECT_THAT(done[0], HasSubstr("Less: ")) << "the map with the larger error comes first";
  std::vector<std::string> lost;
  EXPECT_THAT(library.LoadScene(open, &lost).text, HasSubstr("fox"));
}

TEST(SessionMap, ContentThatOnlyMovedIsNotStoredInThePlaceOfWhatCannotBeRead) {
  SessionMap map;
  map.snapshot = map.saved_snapshot = WalkedMap();
  map.scene = map.saved_scene = std::make_shared<const content::Scene>(SignOfMaintenance("here"));
  map.content_left_out = true;
  auto shifted = std::make_shared<engine::MapSnapshot>(*WalkedMap());
  for (engine::MapPoint& point : shifted->points) {
    if (!point.infinite()) point.point_in_map.x() += 0.1;
  }
  const auto before = map.scene;
  map.UpdateSnapshot(shifted);
  ASSERT_NE(map.scene, before) << "the sign has not moved along";
  EXPECT_TRUE(map.NeedsSave());
  EXPECT_EQ(map.scene, map.saved_scene);
  map.scene = std::make_shared<const content::Scene>(SignOfMaintenance("edited"));
  EXPECT_NE(map.scene, map.saved_scene);
}

TEST_F(IdleMaps, AreAdjustedWithContentThatTheSessionReadsInAnotherForm) {
  const auto simulation = Room(1);
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
  {
    maps::MapRecord record;
    record.key = library.FindByName("Open").key;
    content::Scene scene = SignOfMaintenance("here");
    scene.entities[0].signpost.to_map = "Fixed";  // Without a key, which the session adds.
    record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
    library.Save(record);
  }
  Session session(Options(Pace::kEager, ""), LensOf(*simulation), &library);
  ASSERT_EQ(AwaitMaintenance(&session).size(), 1u);
  session.Finish();
  EXPECT_GT(library.FindByName("Open").revision, WalkedMap()->revision);
  EXPECT_THAT(library.LoadScene(library.FindByName("Open").key).text, HasSubstr("here"));
}

TEST_F(IdleMaps, AreNotAdjustedOnATourOrInLockstep) {
  const auto simulation = Room(1);
  // Three sessions with a copy of the library each. The one that maintains its maps begins last: when it is
  // done, the others have had more time for the same work.
  const auto copy = [&](const std::string& name) {
    std::filesystem::copy_file(file_, folder_ / name);
    return folder_ / name;
  };
  auto toured = maps::Library::Open(copy("tour.docent"), maps::Access::kReadOnly);
  auto in_lockstep = maps::Library::Open(copy("lockstep.docent"), maps::Access::kReadWrite);
  auto maintained = maps::Library::Open(copy("maintained.docent"), maps::Access::kReadWrite);
  const auto toured_before = toured.List(), in_lockstep_before = in_lockstep.List();
  SessionOptions tour_options = Options(Pace::kEager, "");
  tour_options.may_write = false;
  Session tour(tour_options, LensOf(*simulation), &toured);
  Session lockstep(Options(Pace::kLockstep, ""), LensOf(*simulation), &in_lockstep);
  Session author(Options(Pace::kEager, ""), LensOf(*simulation), &maintained);
  ASSERT_EQ(AwaitMaintenance(&author).size(), 1u);
  EXPECT_THAT(MaintenanceDetails(&tour), IsEmpty());
  EXPECT_THAT(MaintenanceDetails(&lockstep), IsEmpty());
  for (Session* session : {&tour, &lockstep, &author}) session->Finish();
  EXPECT_EQ(toured.List(), toured_before);
  EXPECT_EQ(in_lockstep.List(), in_lockstep_before);
}

// For the sanitizers: frames, saves, commands, map switches and maintenance at the same time.
TEST_F(IdleMaps, StayValidWhileOtherMapsAreExtended) {
  const auto simulation = Room(3);
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
  SessionOptions options = Options(Pace::kEager, "New");
  options.autosave_interval = std::chrono::milliseconds(100);
  options.provisional.time = std::chrono::milliseconds(100);
  Session session(options, LensOf(*simulation), &library);
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kEager;
  std::uint64_t frames = 0;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              const std::uint64_t at = ++frames;
              if (at % 20 == 0) session.Execute(Save{}, frame);
              if (at == 40) session.Execute(SetPolicy{"Fixed", maps::Policy::kOpen}, frame);
              if (at == 50) session.Execute(UseMap{"Open"}, frame);
              if (at == 70) session.Execute(UseMap{"Fixed"}, frame);
            },
            {});
  session.Finish();
  EXPECT_THAT(library.Verify(), IsEmpty());
  int validated = 0;
  for (const Session::MapState& map : session.Maps()) {
    if (map.discarded || !map.snapshot) continue;
    EXPECT_EQ(engine::Validate(*map.snapshot), "") << map.name;
    ++validated;
  }
  EXPECT_GE(validated, 2) << "both idle maps at least";
}

// Holds up the saves of a library, as a slow disk does: the library reads the clock in each of them.
class SlowDisk {
 public:
  maps::LibraryOptions Options() {
    maps::LibraryOptions options;
    options.clock = [this] {
      reached_ = true;
      open_.wait(false);
      return maps::WallTime();
    };
    return options;
  }
  bool IsReached() const { return reached_; }
  void Open() {
    open_ = true;
    open_.notify_all();
  }

 private:
  std::atomic<bool> reached_ = false, open_ = false;
};

// While maintenance saves a map and thus keeps the saver's thread busy, a command waits for another save.
TEST_F(IdleMaps, AreSavedWhileAPolicyCommandWaitsForTheDiskWithoutDelayingFrames) {
  using namespace std::chrono_literals;
  {
    auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
    library.Save({library.NewKey(), "Current", maps::Policy::kAugmentOnly, WalkedMap(),
                  std::make_shared<maps::SceneRecord>(RecordFromScene(SignOfMaintenance("here")))});
  }
  SlowDisk disk;
  const auto simulation = Room(1);
  auto library =
      maps::Library::Open(file_, maps::Access::kReadWrite, maps::CreateIfMissing::kNo, disk.Options());
  Session session(Options(Pace::kEager, ""), LensOf(*simulation), &library);
  const engine::TrackedFrame no_frame;
  session.Execute(UseMap{"Current"}, no_frame);
  session.Execute(MoveEntity{"sign-1", {0.01, 0, 0}, {}}, no_frame);
  for (int i = 0; i < 6000 && !disk.IsReached(); ++i) std::this_thread::sleep_for(20ms);
  ASSERT_TRUE(disk.IsReached()) << "maintenance of the map Open must have come to its save";

  auto command = std::async(std::launch::async, [&] {
    session.Execute(SetPolicy{"Current", maps::Policy::kReadOnly}, no_frame);
  });
  EXPECT_EQ(command.wait_for(200ms), std::future_status::timeout) << "the command must wait for its save";
  auto listed = std::async(std::launch::async, [&] { return session.Maps(); });
  EXPECT_EQ(listed.wait_for(30s), std::future_status::ready) << "the session must not be locked meanwhile";
  disk.Open();
  if (command.wait_for(60s) != std::future_status::ready) {
    ADD_FAILURE() << "deadlock";
    std::abort();  // neither thread can be ended
  }
  command.get();
  EXPECT_EQ(listed.get().size(), 3u);
  session.Finish();
  EXPECT_EQ(library.FindByName("Current").policy, maps::Policy::kReadOnly);
  EXPECT_THAT(MaintenanceDetails(&session), ::testing::ElementsAre(HasSubstr("Open: ")));
}

}  // namespace
}  // namespace docent::app
