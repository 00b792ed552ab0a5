// SPDX-License-Identifier: Apache-2.0
// Records every command of a session as a script, and replays the script in another one.
#include <gmock/gmock.h>

#include <set>

#include "app/demo/exhibit_model.h"
#include "app/script/format_command.h"
#include "app/script/script_file.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/content/media_samples.h"

namespace docent::app {
namespace {

using namespace simulated_session;
using ::testing::IsEmpty;

struct Planned {
  double seconds;
  Command command;
};

// Every command. The first map is built for two seconds, then the second one.
std::vector<Planned> EveryCommand() {
  using enum content::EntityFlag;
  const Eigen::Vector2d pixel(320, 290), other(300, 300);
  const engine::Sim3 pose{engine::Rotation3::Exp({0.1, 0.2, 0.3}), {1.0 / 3, -0.1, 2}, 0.7};
  const std::vector<PointPair> pairs = {{{0, 0, 0}, {0, 0, 0}, pixel},
                                        {{1, 0, 0}, {0.5, 0.01, 2}, std::nullopt},
                                        {{0, 1, 0}, {0.02, 0.5, 2}, std::nullopt},
                                        {{0, 0, 1}, {0, 0.03, 2.5}, std::nullopt},
                                        {{1, 1, 1}, {0.5, 0.5, 2.6}, std::nullopt}};
  std::vector<Planned> plan = {{0, NewMap{"First hall"}}};
  double seconds = 2;
  const auto then = [&](Command command) {
    plan.push_back({seconds, std::move(command)});
    seconds += 0.01;  // Several commands come with one image.
  };
  then(PlaceModel{"exhibit.glb", pixel, std::nullopt, 1.0 / 3});
  then(PlaceModel{"exhibit.glb", other, 0.1, 0});
  then(PlaceSignpost{"two\nlines # of \"text\"", other, ""});
  then(MoveEntity{"exhibit", {0.1 / 3, 0, 0}, std::nullopt});
  then(MoveEntity{"exhibit", {0, 0, 0}, other});
  then(RotateEntity{"exhibit", 10.0 / 3});
  then(ScaleEntity{"exhibit", 1.0 / 0.7});
  then(TransformEntities{{{"exhibit-2", pose}}});
  then(AlignEntity{"exhibit", pairs});
  then(BendEntity{"exhibit-2", pairs});
  then(DuplicateEntities{{"exhibit-2", "sign-1"}});
  then(UnbendEntity{"exhibit-2"});
  then(RenameEntity{"exhibit", "from"});
  then(SetEntityText{"sign-2", "ähnlich"});
  then(SetEntityFlag{{"from", "sign-2"}, kLocked, true});
  then(SetEntityFlag{{"from"}, kLocked, false});
  then(SetEntityFlag{{"sign-1"}, kHidden, true});
  then(GroupEntities{{"from", "sign-1"}, "a group"});
  then(PasteEntities{{"from"}, "First hall", pixel});
  then(PlaceLabel{"Tusk # \"left\"", pixel, Eigen::Vector3d(0.1, -0.2, 1.0 / 3)});
  then(PlaceLabel{"Foot", other});
  then(SetLabelOffset{"label-2", {0, -1.0 / 7, 0}});
  then(SetEntityText{"label-1", "Stoßzahn", "de"});
  then(PlaceImage{"plan.png", pixel});
  then(PlaceImage{"plan.png", other, 0.3, true});
  then(RotateEntity{"plan", 5});
  then(PlaceSound{"bell.wav", "A bell", pixel, 1.5});
  then(ScaleEntity{"bell", 1.0 / 3});
  then(PlaceTrail{{{{0, 0, 0}, pixel}, {{0, 0, 0}, other}}});
  then(ExtendTrail{"trail-1", {{0.1, 0.2, 2}}});
  then(ExtendTrail{"trail-1", {{0, 0, 0}, pixel}});
  then(ShortenTrail{"trail-1"});
  then(MoveEntity{"trail-1", {0.01, 0, 0}, std::nullopt});
  then(PlaceOccluder{
      content::Occluder::Shape::kBox, Eigen::Vector3d(0.1, 1.0 / 3, 0.2), {{{0, 0, 0}, pixel}}, 30});
  then(ResizeOccluder{"occluder-1", {0.2, 1.0 / 7, 0.3}});
  then(DuplicateEntities{{"label-1", "plan", "bell", "trail-1"}});
  then(RemoveEntities{{"exhibit-2"}});
  then(SetMapScale{pixel, other, 0.5});
  then(SetMapUp{Eigen::Vector2d(600, 400)});  // The floor.
  then(SetMapEntrance{});
  then(SetMapEntrance{false});
  then(Undo{});
  then(Redo{});
  then(SetPolicy{"First hall", maps::Policy::kAugmentOnly});
  then(SetPolicy{"First hall", maps::Policy::kOpen});
  then(Save{});
  then(StopMap{});
  plan.push_back({2.5, NewMap{"Second hall"}});
  seconds = 4.5;
  then(PlaceSignpost{"back", pixel, "First hall"});
  then(SetSignpostTarget{"sign-1", ""});
  then(SetSignpostTarget{"sign-1", "First hall"});
  then(SetSignpostDirection{"sign-1", Eigen::Vector3d(1.0 / 3, 0, -2)});
  then(SetSignpostDirection{"sign-1", std::nullopt});
  then(SetSignpostDirection{"sign-1", std::nullopt, true});
  then(PasteEntities{{"from", "sign-2"}, "First hall", std::nullopt});
  then(RenameMap{"First hall", "Old hall"});
  then(UseMap{"Second hall"});
  plan.push_back({4.9, RemoveMap{"Old hall"}});
  return plan;
}

struct Recorded {
  std::string script;
  std::vector<std::string> maps;  // Name and scene of each map in the library.
  std::vector<std::string> refused;
};

class Replay : public ::testing::Test {
 protected:
  Replay() {
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
    content::WriteBytes(folder_ / "plan.png", content::PngBytes(4, 3));
    content::WriteBytes(folder_ / "bell.wav",
                        content::SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 1, 8000, 800));
  }

  // Runs a session in lockstep with a script, and with commands from a window.
  Recorded Run(const std::string& file, const std::vector<Planned>& plan, std::vector<TimedCommand> script) {
    const auto simulation = Room(5);
    maps::Library library =
        maps::Library::Open(folder_ / file, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    Session session(Options(Pace::kLockstep, ""), LensOf(*simulation), &library);
    CalibratedCamera camera = CameraOf(simulation);
    CommandInbox inbox;
    Recorded recorded;
    FrameLoopOptions loop;
    loop.pace = Pace::kLockstep;
    loop.script = std::move(script);
    loop.model_folder = folder_.path();
    loop.inbox = &inbox;
    loop.carried_out = [&](const TimedCommand& command) {
      recorded.script += FormatScriptLine(command) + '\n';
    };
    loop.refused = [&](const std::string& error) { recorded.refused.push_back(error); };
    std::size_t next = 0;
    std::optional<Timestamp> first;
    RunFrames(&camera, &session, loop,
              [&](const engine::TrackedFrame& frame) {
                if (!first) first = frame.frame.time;
                for (; next < plan.size() && frame.frame.time - *first >= FromSeconds(plan[next].seconds);
                     ++next)
                  inbox.Push({plan[next].command, nullptr});
              },
              {});
    session.Finish();
    EXPECT_EQ(next, plan.size());
    for (const maps::MapInfo& map : library.List())
      recorded.maps.push_back(map.name + ": " + library.LoadScene(map.key).text);
    EXPECT_THAT(library.Verify(), IsEmpty());
    return recorded;
  }

  const TemporaryFolder folder_;
};

TEST_F(Replay, OfARecordedScriptGivesTheSameBytesOfEveryScene) {
  std::vector<Planned> plan = EveryCommand();
  std::set<std::size_t> kinds;
  for (const Planned& planned : plan) kinds.insert(planned.command.index());
  kinds.insert(Command(JoinMap{}).index());  // below, instead of the removal
  // Authors are not led along a tour.
  EXPECT_EQ(kinds.size(), std::variant_size_v<Command> - 1) << "a command is not tested";
  const Recorded removed = Run("removed.docent", plan, {});
  EXPECT_THAT(removed.refused, IsEmpty());
  ASSERT_EQ(removed.maps.size(), 1u) << "the other map was removed";
  EXPECT_THAT(removed.maps[0], testing::HasSubstr("\"from\""));
  EXPECT_EQ(Run("removed2.docent", {}, ParseScript(removed.script, "script")).maps, removed.maps);

  plan.back().command = JoinMap{"Old hall"};
  const Recorded joined = Run("joined.docent", plan, {});
  EXPECT_THAT(joined.refused, IsEmpty());
  ASSERT_EQ(joined.maps.size(), 1u) << "both show the same room";
  for (const char* kept : {"label-1", "\"back\""}) EXPECT_THAT(joined.maps[0], testing::HasSubstr(kept));
  EXPECT_EQ(Run("joined2.docent", {}, ParseScript(joined.script, "script")).maps, joined.maps);

  plan.pop_back();  // The first map stays.
  const Recorded first = Run("a.docent", plan, {});
  EXPECT_THAT(first.refused, IsEmpty());
  ASSERT_EQ(first.maps.size(), 2u);
  for (const char* kept : {"label-1", "Stoßzahn", "plan-2", "bell-2", "trail-2", "\"direction\":["})
    EXPECT_THAT(first.maps[0] + first.maps[1], testing::HasSubstr(kept));
  const Recorded second = Run("b.docent", {}, ParseScript(first.script, "script"));
  EXPECT_EQ(second.maps, first.maps);
  EXPECT_EQ(second.script, first.script) << "a replayed script is recorded as it was";
}

}  // namespace
}  // namespace docent::app
