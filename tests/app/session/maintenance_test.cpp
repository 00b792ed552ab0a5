// SPDX-License-Identifier: Apache-2.0
// What a session does for idle maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "app/session/maintenance_order.h"
#include "engine/base/random.h"
#include "maps/maintenance.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

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

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
};

TEST_F(IdleMaps, AreAdjustedWhileTheSessionIsIdle) {
  const auto simulation = Room(1);
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
  const double before = RmsOf(library, "Open");
  Session session(Options(Pace::kEager, ""), LensOf(*simulation), &library);
  std::vector<std::string> done;
  // Two minutes at most, as the machine may be slow.
  for (int i = 0; i < 6000 && done.empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    for (std::string& detail : MaintenanceDetails(&session)) done.push_back(std::move(detail));
  }
  ASSERT_EQ(done.size(), 1u);
  EXPECT_THAT(done[0], HasSubstr("Open: "));
  session.Finish();
  EXPECT_LT(RmsOf(library, "Open"), 0.5 * before);
  EXPECT_DOUBLE_EQ(RmsOf(library, "Fixed"), before);
  EXPECT_THAT(library.Verify(), IsEmpty());
  // The session has in memory what was saved.
  for (const Session::MapState& map : session.Maps()) {
    if (map.name == "Open") {
      EXPECT_EQ(map.snapshot->revision, library.FindByName("Open").revision);
    }
  }
}

TEST_F(IdleMaps, AreNotAdjustedOnATourOrInLockstep) {
  const auto simulation = Room(1);
  for (const bool may_write : {false, true}) {
    auto library = maps::Library::Open(file_, may_write ? maps::Access::kReadWrite : maps::Access::kReadOnly);
    const auto before = library.List();
    SessionOptions options = Options(may_write ? Pace::kLockstep : Pace::kEager, "");
    options.may_write = may_write;
    Session session(options, LensOf(*simulation), &library);
    std::this_thread::sleep_for(std::chrono::milliseconds(600));  // maintenance would have started by then
    EXPECT_THAT(MaintenanceDetails(&session), IsEmpty());
    session.Finish();
    EXPECT_EQ(library.List(), before);
  }
}

// For the sanitizers: frames, saves, commands, map switches and maintenance at the same time.
TEST_F(IdleMaps, StayValidWhileOtherMapsAreExtended) {
  const auto simulation = Room(3);
  auto library = maps::Library::Open(file_, maps::Access::kReadWrite);
  SessionOptions options = Options(Pace::kEager, "New");
  options.autosave_interval = std::chrono::milliseconds(100);
  options.provisional_time = std::chrono::milliseconds(100);
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
  for (const Session::MapState& map : session.Maps()) {
    if (map.discarded || !map.snapshot) continue;
    EXPECT_EQ(engine::Validate(*map.snapshot), "") << map.name;
  }
}

}  // namespace
}  // namespace docent::app
