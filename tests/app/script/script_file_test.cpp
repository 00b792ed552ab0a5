// SPDX-License-Identifier: Apache-2.0
#include "app/script/script_file.h"

#include <gmock/gmock.h>

#include "app/script/format_command.h"
#include "engine/base/random.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Script, ReadsEveryCommandOfTheManual) {
  const auto commands = ParseScript(
      "# builds a desk\n"
      "0 map new \"Desk 3\"   # its name has a blank\n"
      "\n"
      "1.5 place models/helmet.glb at pixel 320 240.5 scale 0.2 yaw -90\n"
      "2 signpost \"Say \\\"hello\\\" # here\\nnow\" at pixel 10 20 to \"Desk 4\"\r\n"
      "3 map policy \"Desk 3\" augment-only\n"
      "4 move helmet 0.1 0 -0.2\n"
      "4 move helmet to pixel 1 2\n"
      "5 rotate helmet 45\n"
      "6 scale helmet 2\n"
      "7 remove helmet\n"
      "8 undo\n9 redo\n10 save\n11 map stop\n12 map use Desk\n"
      "13 place helmet.glb at pixel 1 2 yaw 5\n"
      "14 map up pixel 1 2\n"
      "14 map up automatic\n"
      "14 map scale pixel 1 2 to pixel 3 4 is 2.5\n"
      "14 map scale unknown\n"
      "14 map entrance\n"
      "14 map entrance automatic\n"
      "14 transform helmet 1 2 3 0 0.6 0 0.8 2.5\n"
      "14 transform helmet 1 2 3 0 0.6 0 0.8 2.5, sign-1 1 2 3 0 0.6 0 0.8 2.5\n"
      "14 remove helmet \"from\" sign-1\n"
      "14 duplicate helmet\n"
      "14 rename helmet hat\n"
      "14 text sign-1 \"To the hats\"\n"
      "14 target sign-1 \"Desk 3\"\n"
      "14 target sign-1\n"
      "14 direction sign-1 0.5 0 -2\n"
      "14 direction sign-1 ahead\n"
      "14 direction \"ahead\" unknown\n"
      "14 lock hat sign-1\n14 unlock hat\n14 hide hat\n14 show hat\n"
      "14 group \"Old hats\" hat sign-1\n"
      "14 ungroup hat\n"
      "14 paste hat \"from\" from \"Desk 3\"\n"
      "14 paste hat from Desk at pixel 3 4\n"
      "15 align hat 0 0 0 to pixel 1 2, 1 0 0 to 3 4 5 , 0 1 0 to pixel 6 7\n"
      "15 bend hat 0 0 0 to 0 0 0, 1 0 0 to 1 0 0, 0 1 0 to 0 1 0, 0 0 1 to 0 0 1.5\n"
      "15 unbend hat\n"
      "15 map rename Desk Bureau\n"
      "16 map join Desk\n"
      "16 map remove Bureau\n",
      "script");
  ASSERT_EQ(commands.size(), 46u);
  EXPECT_EQ(commands[0].command, Command(NewMap{"Desk 3"}));
  EXPECT_EQ(commands[0].line, 2);
  EXPECT_EQ(commands[1].time, std::chrono::milliseconds(1500));
  EXPECT_EQ(commands[1].line, 4);
  EXPECT_EQ(commands[1].command, Command(PlaceModel{"models/helmet.glb", {320, 240.5}, 0.2, -90}));
  EXPECT_EQ(commands[2].command, Command(PlaceSignpost{"Say \"hello\" # here\nnow", {10, 20}, "Desk 4"}));
  EXPECT_EQ(commands[3].command, Command(SetPolicy{"Desk 3", maps::Policy::kAugmentOnly}));
  EXPECT_EQ(commands[4].command, Command(MoveEntity{"helmet", {0.1, 0, -0.2}, std::nullopt}));
  EXPECT_EQ(commands[5].command, Command(MoveEntity{"helmet", {0, 0, 0}, Eigen::Vector2d(1, 2)}));
  EXPECT_EQ(commands[6].command, Command(RotateEntity{"helmet", 45}));
  EXPECT_EQ(commands[7].command, Command(ScaleEntity{"helmet", 2}));
  EXPECT_EQ(commands[8].command, Command(RemoveEntities{{"helmet"}}));
  EXPECT_EQ(commands[9].command, Command(Undo{}));
  EXPECT_EQ(commands[10].command, Command(Redo{}));
  EXPECT_EQ(commands[11].command, Command(Save{}));
  EXPECT_EQ(commands[12].command, Command(StopMap{}));
  EXPECT_EQ(commands[13].command, Command(UseMap{"Desk"}));
  EXPECT_EQ(commands[14].command, Command(PlaceModel{"helmet.glb", {1, 2}, std::nullopt, 5}));
  const engine::Sim3 pose{engine::Rotation3(Eigen::Quaterniond(0.8, 0, 0.6, 0)), {1, 2, 3}, 2.5};
  using Names = std::vector<std::string>;
  using enum content::EntityFlag;
  const std::vector<Command> rest = {SetMapUp{Eigen::Vector2d(1, 2)},
                                     SetMapUp{},
                                     SetMapScale{{1, 2}, {3, 4}, 2.5},
                                     SetMapScale{},
                                     SetMapEntrance{},
                                     SetMapEntrance{false},
                                     TransformEntities{{{"helmet", pose}}},
                                     TransformEntities{{{"helmet", pose}, {"sign-1", pose}}},
                                     RemoveEntities{{"helmet", "from", "sign-1"}},
                                     DuplicateEntities{{"helmet"}},
                                     RenameEntity{"helmet", "hat"},
                                     SetEntityText{"sign-1", "To the hats"},
                                     SetSignpostTarget{"sign-1", "Desk 3"},
                                     SetSignpostTarget{"sign-1", ""},
                                     SetSignpostDirection{"sign-1", Eigen::Vector3d(0.5, 0, -2)},
                                     SetSignpostDirection{"sign-1", std::nullopt, true},
                                     SetSignpostDirection{"ahead"},
                                     SetEntityFlag{{"hat", "sign-1"}, kLocked, true},
                                     SetEntityFlag{{"hat"}, kLocked, false},
                                     SetEntityFlag{{"hat"}, kHidden, true},
                                     SetEntityFlag{{"hat"}, kHidden, false},
                                     GroupEntities{{"hat", "sign-1"}, "Old hats"},
                                     GroupEntities{{"hat"}, ""},
                                     PasteEntities{{"hat", "from"}, "Desk 3", std::nullopt},
                                     PasteEntities{Names{"hat"}, "Desk", Eigen::Vector2d(3, 4)},
                                     AlignEntity{"hat",
                                                 {{{0, 0, 0}, {0, 0, 0}, Eigen::Vector2d(1, 2)},
                                                  {{1, 0, 0}, {3, 4, 5}, std::nullopt},
                                                  {{0, 1, 0}, {0, 0, 0}, Eigen::Vector2d(6, 7)}}},
                                     BendEntity{"hat",
                                                {{{0, 0, 0}, {0, 0, 0}, std::nullopt},
                                                 {{1, 0, 0}, {1, 0, 0}, std::nullopt},
                                                 {{0, 1, 0}, {0, 1, 0}, std::nullopt},
                                                 {{0, 0, 1}, {0, 0, 1.5}, std::nullopt}}},
                                     UnbendEntity{"hat"},
                                     RenameMap{"Desk", "Bureau"},
                                     JoinMap{"Desk"},
                                     RemoveMap{"Bureau"}};
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_EQ(commands[15 + i].command, rest[i]) << i;
}

TEST(Script, IsReadBackEqualAfterWriting) {
  const std::vector<Command> commands = {
      NewMap{"stop"},
      NewMap{"a \"b\" \\ # c"},
      StopMap{},
      UseMap{"Desk"},
      SetPolicy{"to", maps::Policy::kReadOnly},
      PlaceModel{"a b.glb", {1.0 / 3, 2}, 1, 0},
      PlaceModel{"x.glb", {1, 2}, 1e-3, 1.0 / 7},
      PlaceSignpost{"two\nlines", {3, 4}, ""},
      PlaceSignpost{"to", {3, 4}, "pixel"},
      MoveEntity{"sign-1", {1e-9, 2, -3}, std::nullopt},
      MoveEntity{"sign-1", {0, 0, 0}, Eigen::Vector2d(5, 6)},
      RotateEntity{"helmet", -12.5},
      ScaleEntity{"helmet", 0.5},
      RemoveEntities{{"helmet 2", "from"}},
      PasteEntities{{"from", "at"}, "from", std::nullopt},
      Undo{},
      GuideVisitor{GuideVisitor::Step::kSkip},
      GuideVisitor{GuideVisitor::Step::kBack},
      GuideVisitor{GuideVisitor::Step::kOpen, "lion \"1\""},
      GuideVisitor{GuideVisitor::Step::kPress},
      GuideVisitor{GuideVisitor::Step::kMark},
      GuideVisitor{GuideVisitor::Step::kClose},
      GuideVisitor{GuideVisitor::Step::kRestart},
      GuideVisitor{GuideVisitor::Step::kContinue},
      Redo{},
      Save{},
  };
  std::string text;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    text += FormatScriptLine({std::chrono::milliseconds(250 * i), 0, commands[i]}) + "\n";
  }
  const auto read = ParseScript(text, "script");
  ASSERT_EQ(read.size(), commands.size()) << text;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    EXPECT_EQ(read[i].command, commands[i]) << FormatCommand(commands[i]);
    EXPECT_EQ(read[i].time, std::chrono::milliseconds(250 * i));
  }
}

// Ordinary and odd texts: keywords, numbers, quotes, comments, blanks and bytes that are not UTF-8.
std::string AnyText(Random* random) {
  const std::vector<std::string> parts = {"a",
                                          "to",
                                          "pixel",
                                          "at",
                                          "map",
                                          "stop",
                                          "1e5",
                                          "-",
                                          "é",
                                          "→",
                                          " ",
                                          "\"",
                                          "\\",
                                          "\\n",
                                          "#",
                                          "\t",
                                          "\n",
                                          "\r",
                                          "\f",
                                          "\v",
                                          "\xE9",
                                          "\x7F",
                                          std::string(1, '\0'),
                                          "\xEF\xBB\xBF"};
  std::string text;
  while (random->Uniform() < 0.6) text += parts[random->Below(parts.size())];
  return random->Uniform() < 0.01 ? std::string(10'001, 'x') : text;
}

double AnyNumber(Random* random) {
  const std::vector<double> odd = {0, 1, -1, 0.1, 1e-9, 1e9, 5e-324, 1.7e308, 1e12, 1.0 / 3, -2.5e-7};
  if (random->Uniform() < 0.3) return odd[random->Below(odd.size())];
  return random->Uniform(-1000, 1000);
}

Command AnyCommand(Random* random) {
  const auto text = [&] { return AnyText(random); };
  const auto number = [&] { return AnyNumber(random); };
  const auto pixel = [&] { return Eigen::Vector2d(number(), number()); };
  const auto names = [&] {
    std::vector<std::string> some;
    while (random->Uniform() < 0.7) some.push_back(text());
    return some;
  };
  const auto pairs = [&] {
    std::vector<PointPair> some;
    while (random->Uniform() < 0.8) {
      PointPair& pair = some.emplace_back();
      pair.in_model = {number(), number(), number()};
      if (random->Below(2) == 0) {
        pair.pixel = pixel();
      } else {
        pair.in_map = {number(), number(), number()};
      }
    }
    return some;
  };
  switch (random->Below(27)) {
    case 0:
      return NewMap{text()};
    case 1:
      return StopMap{};
    case 2:
      return UseMap{text()};
    case 3:
      return SetPolicy{text(), static_cast<maps::Policy>(random->Below(4))};
    case 4:
      return PlaceModel{text(), pixel(), number(), number()};
    case 5:
      return PlaceModel{text(), pixel()};
    case 6:
      return PlaceSignpost{text(), pixel(), text()};
    case 7:
      return MoveEntity{text(), {number(), number(), number()}, std::nullopt};
    case 8:
      return MoveEntity{text(), {0, 0, 0}, pixel()};
    case 9:
      return RotateEntity{text(), number()};
    case 10:
      return ScaleEntity{text(), number()};
    case 11:
      return RemoveEntities{names()};
    case 12:
      return Undo{};
    case 13: {
      const Eigen::Vector3d turn(random->Uniform(-9, 9), random->Uniform(-9, 9), random->Uniform(-9, 9));
      TransformEntities transform;
      for (const std::string& name : names())
        transform.poses.push_back(
            {name, {engine::Rotation3::Exp(turn), {number(), number(), number()}, number()}});
      return transform;
    }
    case 14:
      return DuplicateEntities{names()};
    case 15:
      return RenameEntity{text(), text()};
    case 16:
      return SetEntityText{text(), text()};
    case 17:
      return SetSignpostTarget{text(), text()};
    case 18:
      return SetEntityFlag{
          names(), random->Below(2) == 0 ? content::EntityFlag::kLocked : content::EntityFlag::kHidden,
          random->Below(2) == 0};
    case 19:
      return GroupEntities{names(), text()};
    case 20:
      return random->Below(2) == 0 ? PasteEntities{names(), text(), pixel()}
                                   : PasteEntities{names(), text(), std::nullopt};
    case 21:
      return RenameMap{text(), text()};
    case 22:
      return random->Below(2) == 0 ? Command(RemoveMap{text()}) : Command(JoinMap{text()});
    case 23:
      return AlignEntity{text(), pairs()};
    case 24:
      return BendEntity{text(), pairs()};
    case 25:
      return UnbendEntity{text()};
    case 26: {
      SetSignpostDirection direction{text()};
      if (random->Below(3) > 0) direction.direction = {number(), number(), number()};
      direction.ahead = !direction.direction && random->Below(2) == 0;
      return direction;
    }
    default:
      return random->Below(2) == 0 ? Command(Redo{}) : Command(Save{});
  }
}

TEST(Script, EveryRandomCommandIsInvalidOrReadBackEqual) {
  Random random(3);
  int valid = 0, invalid = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    const TimedCommand command{Timestamp(static_cast<std::int64_t>(random.Uniform(0, 1e12))), 1,
                               AnyCommand(&random)};
    const std::string line = FormatScriptLine(command);
    const std::string problem = Validate(command.command);
    if (!problem.empty()) {
      EXPECT_NE(ErrorOf([&] { ParseScript(line, "s"); }), "") << line << ": " << problem;
      ++invalid;
      continue;
    }
    const auto read = ParseScript(line, "s");
    ASSERT_EQ(read.size(), 1u) << line;
    EXPECT_EQ(read[0].command, command.command) << line;
    EXPECT_EQ(read[0].time, command.time) << line;
    ++valid;
  }
  EXPECT_GT(valid, 5000);
  EXPECT_GT(invalid, 2000);
}

TEST(Script, WritesNumbersAsTheyWereRead) {
  const std::string line = "0.15 place a.glb at pixel 320.1 0.15 scale 0.15 yaw -12.3";
  EXPECT_EQ(FormatScriptLine(ParseScript(line, "s").at(0)), line);
}

// So that a replayed script gives a model exactly the pose that it had.
TEST(Script, ARotationIsTheSameAfterItWasWrittenAndRead) {
  Random random(9);
  for (int trial = 0; trial < 20'000; ++trial) {
    const Eigen::Vector4d q(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1),
                            random.Uniform(-1, 1));
    const engine::Rotation3 rotation = Settled(engine::Rotation3(Eigen::Quaterniond(q)));
    ASSERT_EQ(engine::Rotation3(rotation.quaternion()).quaternion().coeffs(), rotation.quaternion().coeffs());
    const std::string line = "0 " + FormatCommand(TransformEntities{{{"a", {rotation, {0, 0, 0}, 1}}}});
    const auto read = std::get<TransformEntities>(ParseScript(line, "s").at(0).command).poses.at(0);
    ASSERT_EQ(read.map_from_entity.rotation.quaternion().coeffs(), rotation.quaternion().coeffs());
  }
}

TEST(Script, NamesTheLineOfAnInvalidCommand) {
  const auto sentence = [](const std::string& line) {
    return ErrorOf([&] { ParseScript("0 save\n" + line + "\n", "'tour.txt'"); });
  };
  for (const char* line : {"save",
                           "x save",
                           "-1 save",
                           "1",
                           "1 dance",
                           "1 map",
                           "1 map close",
                           "1 map new",
                           "1 map new \"\"",
                           "1 map new Desk 3",
                           "1 map new \"Desk",
                           "1 map new \"a\\t\"",
                           "1 map policy Desk",
                           "1 map policy Desk shut",
                           "1 place",
                           "1 place a.glb",
                           "1 place a.glb at",
                           "1 place a.glb at pixel",
                           "1 place a.glb at pixel 1",
                           "1 place a.glb at pixel 1 b",
                           "1 place a.glb at pixel 1 inf",
                           "1 place a.glb at pixel 1 1e9",
                           "1 place a.glb at pixel 1 2 scale 0",
                           "1 place a.glb at pixel 1 2 scale 1e12",
                           "1 place a.glb at pixel 1 2 scale 1e-12",
                           "1 place a.glb at pixel 1 2 yaw 1e300",
                           "1 map new \"a\x01\"",
                           "1 map new caf\xE9",
                           "1 signpost caf\xE9 at pixel 1 2",
                           "1 move a 0 0 1e300",
                           "1 rotate a -1e300",
                           "1 scale a 0",
                           "1 scale a 1e300",
                           "1 place a.glb at pixel 1 2 scale",
                           "1 place a.glb at pixel 1 2 roll 3",
                           "1 signpost at pixel 1 2",
                           "1 signpost \"x\" at pixel 1 2 to",
                           "1 move a 1 2",
                           "1 move a to 1 2",
                           "1 rotate a",
                           "1 scale a -1",
                           "1 remove",
                           "1 remove a a",
                           "1 remove \"\"",
                           "1 duplicate",
                           "1 map up",
                           "1 map up pixel 1",
                           "1 map scale",
                           "1 map scale pixel 1 2 to pixel 3 4",
                           "1 map scale pixel 1 2 to pixel 3 4 is 0",
                           "1 map scale pixel 1 2 to pixel 3 4 is 1e9",
                           "1 transform a 1 2 3 0 0 0 1",
                           "1 transform a 1 2 3 0 0 0 2 1",
                           "1 transform a 1 2 3 0 0 0 1 0",
                           "1 transform a 1 2 3 0 0 0 1 1,",
                           "1 transform a 1 2e6 3 0 0 0 1 1",
                           "1 rename a",
                           "1 rename a \"\"",
                           "1 rename a b c",
                           "1 text a",
                           "1 target",
                           "1 target a b c",
                           "1 lock",
                           "1 group g",
                           "1 ungroup",
                           "1 paste a b",
                           "1 paste from Desk",
                           "1 paste a from Desk at 1 2",
                           "1 map rename a",
                           "1 align a",
                           "1 align a 0 0 0 to 1 2",
                           "1 align a 0 0 0 to 1 2 3, 0 0 1 to 1 2 3",
                           "1 align a 0 0 0 to 1 2 3, 0 0 1 to 1 2 3,",
                           "1 align a 0 0 0 to 1 2 3 0 0 1 to 1 2 3 0 1 0 to 1 1 1",
                           "1 align a 0 0 0 to 1 2 3, 0 0 1 to 1 2 3, 0 1 0 to pixel 1 1e9",
                           "1 align a 0 0 0 to 1 2 3, 0 0 1 to 1 2 3, 0 1 1e300 to 1 1 1",
                           "1 bend a 0 0 0 to 1 2 3, 0 0 1 to 1 2 3, 0 1 0 to 1 1 1",
                           "1 unbend",
                           "1 unbend a b",
                           "1 map rename a \"\"",
                           "1 map remove",
                           "1 map join",
                           "1 undo all",
                           "1 \"save\""}) {
    EXPECT_THAT(sentence(line), AllOf(HasSubstr("'tour.txt', line 2"), testing::EndsWith("."))) << line;
  }
  EXPECT_THAT(sentence("1 map new " + std::string(201, 'x')), HasSubstr("200 bytes"));
  EXPECT_THAT(sentence("1 signpost " + std::string(10'001, 'x') + " at pixel 1 2"), HasSubstr("10000 bytes"));
}

TEST(Script, IsRefusedWhenTimesDecrease) {
  EXPECT_THAT(ErrorOf([] { ParseScript("2 save\n2 save\n1 save\n", "s"); }), HasSubstr("line 3"));
}

TEST(Script, MayBeEmpty) {
  EXPECT_THAT(ParseScript("", "s"), IsEmpty());
  EXPECT_THAT(ParseScript("\n# nothing\n   \n", "s"), IsEmpty());
}

}  // namespace
}  // namespace docent::app
