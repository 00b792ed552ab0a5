// SPDX-License-Identifier: Apache-2.0
#include "app/script/script_file.h"

#include <gmock/gmock.h>

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
      "8 undo\n9 redo\n10 save\n11 map stop\n12 map use Desk\n",
      "script");
  ASSERT_EQ(commands.size(), 14u);
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
  EXPECT_EQ(commands[8].command, Command(RemoveEntity{"helmet"}));
  EXPECT_EQ(commands[9].command, Command(Undo{}));
  EXPECT_EQ(commands[10].command, Command(Redo{}));
  EXPECT_EQ(commands[11].command, Command(Save{}));
  EXPECT_EQ(commands[12].command, Command(StopMap{}));
  EXPECT_EQ(commands[13].command, Command(UseMap{"Desk"}));
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
      RemoveEntity{"helmet 2"},
      Undo{},
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
  switch (random->Below(14)) {
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
      return RemoveEntity{text()};
    case 12:
      return Undo{};
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
