// SPDX-License-Identifier: Apache-2.0
// What happens to a map that a session started where its camera was lost, once the camera is back in the
// first map.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "app/session/library_scene.h"
#include "app/session/surface_at_pixel.h"
#include "content/asset.h"
#include "engine/geometry/sim3.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/maps/map_samples.h"
#include "tests/support/error_of.h"

namespace docent::app {
namespace {

using namespace simulated_session;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Frames of a simulation in a given order; where the order jumps, the camera is displaced abruptly.
class Detour : public FrameSource {
 public:
  Detour(std::shared_ptr<const Simulation> simulation, std::vector<int> order)
      : simulation_(std::move(simulation)), order_(std::move(order)) {
    info_.name = "detour";
    info_.known_camera = simulation_->calibration();
  }
  bool Next(engine::Frame* frame) override {
    if (next_ == order_.size()) return false;
    simulation_->Render(order_[next_], &frame->image);
    frame->image = frame->image.clone();
    frame->index = next_;
    frame->time = FromSeconds(static_cast<double>(next_) / 30);
    ++next_;
    return true;
  }

 private:
  const std::shared_ptr<const Simulation> simulation_;
  const std::vector<int> order_;
  std::size_t next_ = 0;
};

void Append(int from, int to, std::vector<int>* order) {
  const int step = from < to ? 1 : -1;
  for (int i = from; i != to; i += step) order->push_back(i);
}

// Along two sides of a block of cabinets: a first part, a jump to a part that is not visible from there, from
// there back into the first part, and the whole way once more.
constexpr int kSeen = 90, kFar = 290;
std::vector<int> DetourOrder() {
  std::vector<int> order;
  Append(0, kSeen, &order);
  Append(kFar, 20, &order);
  Append(20, kFar, &order);
  return order;
}

std::shared_ptr<const Simulation> Simulate(const std::string& scene) {
  SimulationOptions options;
  options.camera = SimulatedCamera(320);
  return MakeSimulation(scene, options);
}

SourceRun RunInOrder(const std::shared_ptr<const Simulation>& simulation, const std::vector<int>& order,
                     Pace pace, maps::Library* library, std::vector<TimedCommand> script = {}) {
  SessionOptions options = Options(pace, "Hall");
  options.new_map_when_lost = true;
  return RunSource(std::make_unique<Detour>(simulation, order), pace, options, library, std::move(script));
}

engine::Sim3 WorldFromMap(const SourceRun& outcome, const Simulation& simulation,
                          const std::vector<int>& order, std::size_t from, std::size_t to,
                          std::uint64_t key) {
  std::vector<Eigen::Vector3d> in_world, in_map;
  for (std::size_t i = from; i < to; ++i) {
    const engine::TrackedFrame& frame = outcome.frames[i];
    if (!engine::HasPose(frame.state) || frame.map_key != key || frame.finite_points == 0) continue;
    in_world.push_back(simulation.world_from_camera(order[i]).translation);
    in_map.push_back(frame.camera_from_map.OriginInSource());
  }
  return engine::AlignSim3(in_world, in_map).value();
}

// The walk with a signpost in each map, each at the image centre of its frame.
constexpr int kSignInFirst = 80, kSignInSecond = kSeen + 100;
const Eigen::Vector2d kMiddle(160, 120);
std::vector<TimedCommand> Signs() {
  const auto at = [](int frame, const std::string& text, const std::string& to) {
    return TimedCommand{FromSeconds((frame - 0.5) / 30.0), 1, PlaceSignpost{text, kMiddle, to}};
  };
  return {at(kSignInFirst, "first", ""), at(kSignInSecond, "second", "Hall")};
}

const SourceRun& JoinedWalk() {
  static const SourceRun outcome =
      RunInOrder(Simulate("loop"), DetourOrder(), Pace::kLockstep, nullptr, Signs());
  return outcome;
}

TEST(LiveJoining, JoinsTheTwoMapsBetweenWhichTheCameraWasLost) {
  const SourceRun& outcome = JoinedWalk();
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("started Hall 2")));
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Hall and Hall 2 were joined")));
  ASSERT_EQ(outcome.maps.size(), 1u) << ::testing::PrintToString(outcome.map_events);
  EXPECT_EQ(outcome.maps[0].name, "Hall");
  EXPECT_EQ(engine::Validate(*outcome.maps[0].snapshot), "");
}

TEST(LiveJoining, KeepsTrackingInTheCoordinatesOfTheFirstMap) {
  const SourceRun& outcome = JoinedWalk();
  ASSERT_EQ(outcome.maps.size(), 1u);
  const auto simulation = Simulate("loop");
  const std::vector<int> order = DetourOrder();
  const std::uint64_t key = outcome.maps[0].key;
  // The first frames define the alignment of the first map with the world, which must hold for all that
  // follows.
  const engine::Sim3 world_from_map = WorldFromMap(outcome, *simulation, order, 0, kSeen, key);
  const std::size_t back = kSeen + static_cast<std::size_t>(kFar - 20);
  int lost = 0;
  double squares = 0, worst = 0;
  for (std::size_t i = back; i < order.size(); ++i) {
    const engine::TrackedFrame& frame = outcome.frames[i];
    if (!engine::HasPose(frame.state) || frame.map_key != key) {
      ++lost;
      continue;
    }
    const double error = (world_from_map * frame.camera_from_map.OriginInSource() -
                          simulation->world_from_camera(order[i]).translation)
                             .norm();
    squares += error * error;
    worst = std::max(worst, error);
  }
  const auto count = static_cast<double>(order.size() - back);
  RecordProperty("rms_mm", static_cast<int>(1000 * std::sqrt(squares / count)));
  RecordProperty("worst_mm", static_cast<int>(1000 * worst));
  EXPECT_EQ(lost, 0) << "frames were lost on the way back through the second map";
  EXPECT_LT(std::sqrt(squares / count), 0.05);
  EXPECT_LT(worst, 0.15);
}

TEST(LiveJoining, KeepsTheContentOfBothMapsInPlace) {
  const SourceRun& outcome = JoinedWalk();
  ASSERT_EQ(outcome.maps.size(), 1u);
  const content::Scene& scene = *outcome.maps[0].scene;
  ASSERT_EQ(scene.entities.size(), 2u);
  EXPECT_EQ(scene.entities[0].signpost.text, "first");
  EXPECT_EQ(scene.entities[1].signpost.text, "second");
  EXPECT_NE(scene.entities[0].name, scene.entities[1].name) << "both were named sign-1";
  EXPECT_EQ(scene.entities[1].signpost.to_map, "") << "it is now in the map that it led to";
  EXPECT_EQ(scene.entities[1].signpost.to_key, 0u);
  const auto simulation = Simulate("loop");
  const std::vector<int> order = DetourOrder();
  const std::size_t back = kSeen + static_cast<std::size_t>(kFar - 20);
  const engine::Sim3 world_from_map =
      WorldFromMap(outcome, *simulation, order, back, order.size(), outcome.maps[0].key);
  const auto lens = LensOf(*simulation).front();
  for (const auto& [entity, number] : {std::pair(0, kSignInFirst), std::pair(1, kSignInSecond)}) {
    // Relative to the camera at placement, whose true pose is known.
    const auto i = static_cast<std::size_t>(number);
    const engine::TrackedFrame& frame = outcome.frames[i];
    const engine::Sim3 world_from_then =
        WorldFromMap(outcome, *simulation, order, entity == 0 ? 0 : kSeen, back, frame.map_key);
    const Eigen::Vector3d before_camera =
        world_from_then.scale * (frame.camera_from_map * SurfaceAtPixel(frame, *lens, kMiddle).point);
    const Eigen::Vector3d anchor = scene.entities[static_cast<std::size_t>(entity)].signpost.anchor;
    EXPECT_LT((world_from_map * anchor - simulation->world_from_camera(order[i]) * before_camera).norm(),
              0.02 * before_camera.norm())
        << "entity " << entity;
  }
}

TEST(LiveJoining, LeavesOneMapInTheLibrary) {
  const TemporaryFolder folder;
  {
    maps::Library library =
        maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    const SourceRun outcome = RunInOrder(Simulate("loop"), DetourOrder(), Pace::kLockstep, &library);
    ASSERT_EQ(outcome.maps.size(), 1u) << ::testing::PrintToString(outcome.map_events);
  }
  const maps::Library library = maps::Library::Open(folder / "l.docent", maps::Access::kReadOnly);
  EXPECT_THAT(library.Verify(), IsEmpty());
  ASSERT_EQ(library.List().size(), 1u);
  EXPECT_EQ(library.List()[0].name, "Hall");
}

// The camera returns to a desk after it was at another desk that looks like it.
TEST(LiveJoining, DoesNotJoinMapsOfLookAlikePlaces) {
  const auto simulation = Simulate("desks:2");
  std::vector<int> first, second;
  for (int i = 0; i < simulation->frame_count(); ++i) {
    if (simulation->label(i) == "build0") first.push_back(i);
    if (simulation->label(i) == "build1") second.push_back(i);
  }
  std::vector<int> order = first;
  order.insert(order.end(), second.begin(), second.end());
  order.insert(order.end(), first.begin(), first.end());
  const SourceRun outcome = RunInOrder(simulation, order, Pace::kLockstep, nullptr);
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("started Hall 2")));
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("were not joined")));
  EXPECT_EQ(outcome.maps.size(), 2u) << ::testing::PrintToString(outcome.map_events);
  EXPECT_EQ(outcome.frames.back().map_key, outcome.maps[0].key);
}

TimedCommand BeforeFrame(std::size_t frame, Command command) {
  return {FromSeconds((static_cast<double>(frame) - 0.5) / 30.0), 1, std::move(command)};
}

// The camera walks on from the first map into the second and back over the whole way.
struct WayBack {
  WayBack() {
    Append(0, 120, &order);
    second = order.size();
    Append(120, 30, &order);
    asked = order.size();
    Append(30, 90, &order);
  }
  std::vector<int> order;
  std::size_t second = 0, asked = 0;  // When the second map begins, and when joining is asked for.
};

TEST(LiveJoining, JoinsTwoMapsWhenAPersonAsksForIt) {
  const WayBack way;
  const SourceRun outcome =
      RunInOrder(Simulate("loop"), way.order, Pace::kLockstep, nullptr,
                 {BeforeFrame(kSignInFirst, PlaceSignpost{"first", kMiddle, ""}),
                  BeforeFrame(way.second, NewMap{"Annex"}), BeforeFrame(way.asked, JoinMap{"Hall"})});
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Annex and Hall were joined")));
  ASSERT_EQ(outcome.maps.size(), 1u) << ::testing::PrintToString(outcome.map_events);
  EXPECT_EQ(outcome.maps[0].name, "Annex");
  EXPECT_EQ(engine::Validate(*outcome.maps[0].snapshot), "");
  EXPECT_EQ(outcome.maps[0].scene->entities.size(), 1u);
}

// The same way, with a signpost in the second map that led to the first one at first.
TEST(LiveJoining, UndoRestoresNoSignpostThatLeadsToAMapThatWasJoined) {
  const WayBack way;
  const SourceRun outcome =
      RunInOrder(Simulate("loop"), way.order, Pace::kLockstep, nullptr,
                 {BeforeFrame(way.second, NewMap{"Annex"}),
                  BeforeFrame(way.asked - 8, PlaceSignpost{"back", kMiddle, "Hall"}),
                  BeforeFrame(way.asked - 4, SetSignpostTarget{"sign-1", ""}),
                  BeforeFrame(way.asked, JoinMap{"Hall"}), BeforeFrame(way.order.size() - 1, Undo{})});
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Annex and Hall were joined")));
  ASSERT_EQ(outcome.maps.size(), 1u) << ::testing::PrintToString(outcome.map_events);
  ASSERT_EQ(outcome.maps[0].scene->entities.size(), 1u);
  EXPECT_EQ(outcome.maps[0].scene->entities[0].signpost.text, "back");
  EXPECT_EQ(outcome.maps[0].scene->entities[0].signpost.to_map, "");
  EXPECT_EQ(outcome.maps[0].scene->entities[0].signpost.to_key, 0u);
}

TEST(LiveJoining, UndoKeepsTheScaleThatCameWithTheOtherMap) {
  const WayBack way;
  const Eigen::Vector2d left(140, 120), right(180, 120);
  const SourceRun outcome =
      RunInOrder(Simulate("loop"), way.order, Pace::kLockstep, nullptr,
                 {BeforeFrame(kSignInFirst, SetMapScale{left, right, 0.3}),
                  BeforeFrame(way.second, NewMap{"Annex"}), BeforeFrame(way.asked - 4, SetMapEntrance{}),
                  BeforeFrame(way.asked, JoinMap{"Hall"}), BeforeFrame(way.order.size() - 1, Undo{})});
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Annex and Hall were joined")));
  ASSERT_EQ(outcome.maps.size(), 1u) << ::testing::PrintToString(outcome.map_events);
  EXPECT_FALSE(outcome.maps[0].scene->settings.entrance);
  EXPECT_GT(outcome.maps[0].scene->settings.metres_per_unit, 0);
}

TEST(LiveJoining, WithAJoinedMapThePartsInTheLibraryAreRemoved) {
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  const WayBack way;
  const SourceRun outcome = RunInOrder(
      Simulate("loop"), way.order, Pace::kLockstep, &library,
      {BeforeFrame(way.second, NewMap{"Annex"}), BeforeFrame(way.asked - 2, Save{}),
       BeforeFrame(way.asked, JoinMap{"Hall"}), BeforeFrame(way.order.size() - 1, RemoveMap{"Annex"})});
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Annex and Hall were joined")));
  EXPECT_THAT(library.List(), IsEmpty());
}

// Makes the library l.docent with a map "Attic", whose signpost leads to a map "Hall" and whose model cannot
// be read. Returns the key of the map.
std::uint64_t SaveDamagedAttic(const TemporaryFolder& folder) {
  std::uint64_t attic = 0;
  {
    maps::Library library =
        OpenLibrary(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    content::Scene scene;
    content::Entity sign;
    sign.name = "sign-1";
    sign.signpost.text = "downstairs";
    sign.signpost.to_map = "Hall";
    content::Entity fox;
    fox.kind = content::Entity::Kind::kModel;
    fox.name = "fox";
    fox.model.asset = std::make_shared<content::Asset>(
        content::ImportAsset(folder.Write("fox.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")));
    scene.entities = {sign, fox};
    maps::MapRecord record;
    record.key = attic = library.NewKey();
    record.name = "Attic";
    record.snapshot = maps::MakeSampleMap(attic, {.keyframes = 2, .points = 10});
    record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
    library.Save(record);
  }
  maps::RunSql(folder / "l.docent", "UPDATE assets SET data = zeroblob(length(data))");
  return attic;
}

TEST(LiveJoining, KeepsContentOfAThirdMapThatCannotBeRead) {
  const TemporaryFolder folder;
  const std::uint64_t attic = SaveDamagedAttic(folder);
  maps::Library library = OpenLibrary(folder / "l.docent", maps::Access::kReadWrite);
  const WayBack way;
  const SourceRun outcome =
      RunInOrder(Simulate("loop"), way.order, Pace::kLockstep, &library,
                 {BeforeFrame(way.second, NewMap{"Annex"}), BeforeFrame(way.asked - 2, Save{}),
                  BeforeFrame(way.asked, JoinMap{"Hall"})});
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Annex and Hall were joined")));
  const auto map = std::find_if(outcome.maps.begin(), outcome.maps.end(),
                                [&](const Session::MapState& state) { return state.key == attic; });
  ASSERT_NE(map, outcome.maps.end());
  ASSERT_EQ(map->scene->entities.size(), 1u) << "the model was left out";
  EXPECT_EQ(map->scene->entities[0].signpost.to_map, "Annex");
  std::vector<std::string> lost;
  EXPECT_THAT(library.LoadScene(attic, &lost).text, HasSubstr("fox"));
}

TEST(LiveJoining, RefusesMapsThatCannotBeJoined) {
  const TemporaryFolder folder;
  SaveDamagedAttic(folder);
  maps::Library library = OpenLibrary(folder / "l.docent", maps::Access::kReadWrite);
  library.Save({library.NewKey(), "Yard", maps::Policy::kOpen, nullptr, nullptr});
  const auto simulation = Simulate("loop");
  Session session(Options(Pace::kLockstep, "Hall"), LensOf(*simulation), &library);
  Detour source(simulation, {0});
  engine::Frame frame;
  ASSERT_TRUE(source.Next(&frame));
  const engine::TrackedFrame tracked = session.Process(frame);
  EXPECT_THAT(ErrorOf([&] { session.Execute(JoinMap{"Attic"}, tracked); }), HasSubstr("is damaged"));
  EXPECT_THAT(ErrorOf([&] { session.Execute(JoinMap{"Yard"}, tracked); }), HasSubstr("has no depth"));
}

TEST(LiveJoining, SaysWhyMapsThatAPersonAskedForAreNotJoined) {
  const auto simulation = Simulate("desks:2");
  std::vector<int> order;
  for (const char* const desk : {"build0", "build1"}) {
    for (int i = 0; i < simulation->frame_count(); ++i) {
      if (simulation->label(i) == desk) order.push_back(i);
    }
  }
  const auto second = static_cast<std::size_t>(
      std::count_if(order.begin(), order.end(), [&](int i) { return simulation->label(i) == "build0"; }));
  const SourceRun outcome =
      RunInOrder(simulation, order, Pace::kLockstep, nullptr,
                 {BeforeFrame(second, NewMap{"Annex"}), BeforeFrame(order.size() - 30, JoinMap{"Hall"})});
  EXPECT_THAT(outcome.map_events, ::testing::Contains(HasSubstr("maps Annex and Hall were not joined: ")));
  EXPECT_EQ(outcome.maps.size(), 2u) << ::testing::PrintToString(outcome.map_events);
}

// With threads the result depends on the machine's speed, but it must be consistent.
TEST(LiveJoining, StaysConsistentWithThreads) {
  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  const SourceRun outcome = RunInOrder(Simulate("loop"), DetourOrder(), Pace::kEager, &library);
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_FALSE(outcome.maps.empty());
  EXPECT_EQ(library.List().size(), outcome.maps.size());
  for (const Session::MapState& map : outcome.maps) {
    EXPECT_EQ(engine::Validate(*map.snapshot), "");
    EXPECT_EQ(library.FindByName(map.name).revision, map.snapshot->revision);
  }
}

}  // namespace
}  // namespace docent::app
