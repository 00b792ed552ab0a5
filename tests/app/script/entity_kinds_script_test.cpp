// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/script/format_command.h"
#include "app/script/scene_commands.h"
#include "app/script/script_file.h"
#include "engine/base/random.h"
#include "tests/support/error_of.h"

// Commands of labels, images, sounds, trails, occluders and translations.
namespace docent::app {
namespace {

using ::testing::HasSubstr;

Command Parsed(const std::string& line) {
  const auto commands = ParseScript("0 " + line, "script");
  EXPECT_EQ(commands.size(), 1u);
  return commands.front().command;
}

TEST(EntityKindsScript, ReadsTheCommandsOfTheManual) {
  EXPECT_EQ(Parsed("label \"Old lion\" at pixel 1 2"), Command(PlaceLabel{"Old lion", {1, 2}}));
  EXPECT_EQ(Parsed("label lion at pixel 1 2 offset 0.1 0 -0.5"),
            Command(PlaceLabel{"lion", {1, 2}, Eigen::Vector3d(0.1, 0, -0.5)}));
  EXPECT_EQ(Parsed("offset label-1 1 2 3"), Command(SetLabelOffset{"label-1", {1, 2, 3}}));
  EXPECT_EQ(Parsed("image plan.png at pixel 3 4"), Command(PlaceImage{"plan.png", {3, 4}}));
  EXPECT_EQ(Parsed("image plan.png at pixel 3 4 upright scale 2"),
            Command(PlaceImage{"plan.png", {3, 4}, 2, true}));
  EXPECT_EQ(Parsed("sound roar.flac \"It roars.\" at pixel 5 6 range 2.5"),
            Command(PlaceSound{"roar.flac", "It roars.", {5, 6}, 2.5}));
  EXPECT_EQ(Parsed("trail at pixel 1 2, 3 4 5 , pixel 6 7"),
            Command(PlaceTrail{
                {{{0, 0, 0}, Eigen::Vector2d(1, 2)}, {{3, 4, 5}}, {{0, 0, 0}, Eigen::Vector2d(6, 7)}}}));
  EXPECT_EQ(Parsed("trail width 0.2 at 0 0 1, 0 0 2"), Command(PlaceTrail{{{{0, 0, 1}}, {{0, 0, 2}}}, 0.2}));
  EXPECT_EQ(Parsed("trail extend trail-1 to pixel 1 2"),
            Command(ExtendTrail{"trail-1", {{0, 0, 0}, Eigen::Vector2d(1, 2)}}));
  EXPECT_EQ(Parsed("trail shorten \"to\""), Command(ShortenTrail{"to"}));
  using Shape = content::Occluder::Shape;
  const Eigen::Vector2d pixel(1, 2);
  EXPECT_EQ(Parsed("occluder box at pixel 1 2"),
            Command(PlaceOccluder{Shape::kBox, std::nullopt, {{{0, 0, 0}, pixel}}}));
  EXPECT_EQ(Parsed("occluder box size 1 2 3 at 4 5 6 yaw 30"),
            Command(PlaceOccluder{Shape::kBox, Eigen::Vector3d(1, 2, 3), {{{4, 5, 6}}}, 30}));
  EXPECT_EQ(Parsed("occluder cylinder size 1 2 at 4 5 6"),
            Command(PlaceOccluder{Shape::kCylinder, Eigen::Vector3d(1, 2, 1), {{{4, 5, 6}}}}));
  EXPECT_EQ(Parsed("occluder plane size 1 2 at pixel 1 2 upright"),
            Command(PlaceOccluder{Shape::kPlane, Eigen::Vector3d(1, 2, 0), {{{0, 0, 0}, pixel}}, 0, true}));
  EXPECT_EQ(
      Parsed("occluder polygon at 0 0 1, pixel 1 2, 1 0 1"),
      Command(PlaceOccluder{Shape::kPolygon, std::nullopt, {{{0, 0, 1}}, {{0, 0, 0}, pixel}, {{1, 0, 1}}}}));
  EXPECT_EQ(Parsed("size occluder-1 1 2 0"), Command(ResizeOccluder{"occluder-1", {1, 2, 0}}));
  EXPECT_EQ(Parsed("text label-1 Löwe in de-AT"), Command(SetEntityText{"label-1", "Löwe", "de-AT"}));
  EXPECT_EQ(Parsed("text label-1 \"\" in de"), Command(SetEntityText{"label-1", "", "de"}));
}

TEST(EntityKindsScript, RefusesWhatIsNotOfItsForm) {
  for (const char* line : {"label at pixel 1 2",
                           "label \"\" at pixel 1 2",
                           "label a at 1 2",
                           "label a at pixel 1 2 offset 1 2",
                           "label a at pixel 1 2 offset 1 2 1e7",
                           "offset a 1 2",
                           "image at pixel 1 2",
                           "image a.png at pixel 1 2 scale 0",
                           "image a.png at pixel 1 2 flat",
                           "sound a.wav at pixel 1 2",
                           "sound a.wav \"\" at pixel 1 2",
                           "sound a.wav b at pixel 1 2 range 0",
                           "sound a.wav b at pixel 1 2 range 1e7",
                           "trail at pixel 1 2",
                           "trail at",
                           "trail at 1 2, 3 4",
                           "trail width 0 at 0 0 1, 0 0 2",
                           "trail width 1 at 0 0 1, 0 0 2e6",
                           "trail extend a to 0 0 1, 0 0 2",
                           "trail extend a 0 0 1",
                           "trail shorten",
                           "occluder at 0 0 1",
                           "occluder sphere at 0 0 1",
                           "occluder box size 1 2 at 0 0 1",
                           "occluder box size 1 2 0 at 0 0 1",
                           "occluder plane size 1 -2 at 0 0 1",
                           "occluder cylinder size 1 2e6 at 0 0 1",
                           "occluder box at 0 0 1, 0 0 2",
                           "occluder box at 0 0 1 upright",
                           "occluder plane at 0 0 1 yaw 3",
                           "occluder polygon at 0 0 1, 0 1 1",
                           "occluder polygon size 1 1 at 0 0 1, 0 1 1, 1 0 1",
                           "size a 1 2",
                           "size a 1 2 -1",
                           "text a \"\"",
                           "text a b in",
                           "text a b in x",
                           "text a b in no_tag",
                           "text a b de"}) {
    EXPECT_THAT(ErrorOf([&] { ParseScript(std::string("0 ") + line, "script"); }),
                HasSubstr("script, line 1: "))
        << line;
  }
  std::string many = "0 trail at 0 0 0";
  for (int i = 0; i < 200; ++i) many += ", 0 0 1";
  EXPECT_THAT(ErrorOf([&] { ParseScript(many, "script"); }), HasSubstr("2 to 200 points"));
}

TEST(EntityKindsScript, EachIsReadBackEqualAfterWriting) {
  Random random(29);
  const auto number = [&] { return random.Uniform(-100, 100); };
  const auto pixel = [&] { return Eigen::Vector2d(number(), number()); };
  const auto point = [&] { return Eigen::Vector3d(number(), number(), number()); };
  const auto coin = [&] { return random.Uniform() < 0.5; };
  const auto text = [&] {
    const char* const texts[] = {"a",  "to",      "at", "in", "pixel", "upright", "ä \"b\" # c\nd",
                                 "\\", "trail, x"};
    return std::string(texts[random.Below(std::size(texts))]);
  };
  const auto place = [&] { return coin() ? MapPoint{point()} : MapPoint{Eigen::Vector3d::Zero(), pixel()}; };
  for (int trial = 0; trial < 300; ++trial) {
    PlaceLabel label{text(), pixel()};
    if (coin()) label.offset = point();
    PlaceImage image{text(), pixel(), std::nullopt, coin()};
    if (coin()) image.scale = random.Uniform(0.1, 5);
    PlaceSound sound{text(), text(), pixel()};
    if (coin()) sound.range = random.Uniform(0.1, 5);
    PlaceTrail trail;
    for (std::size_t n = 2 + random.Below(5); n > 0; --n) trail.points.push_back(place());
    if (coin()) trail.width = random.Uniform(0.1, 5);
    PlaceOccluder occluder{static_cast<content::Occluder::Shape>(random.Below(3)), std::nullopt, {place()}};
    const bool is_plane = occluder.shape == content::Occluder::Shape::kPlane;
    const bool is_box = occluder.shape == content::Occluder::Shape::kBox;
    const double width = random.Uniform(0.1, 5);
    if (coin()) occluder.size = {width, random.Uniform(0.1, 5), is_plane ? 0 : is_box ? 2.0 / 3 : width};
    if (is_box && coin()) occluder.yaw_deg = number();
    if (is_plane) occluder.upright = coin();
    PlaceOccluder polygon{content::Occluder::Shape::kPolygon, std::nullopt, {}};
    for (std::size_t n = 3 + random.Below(5); n > 0; --n) polygon.points.push_back(place());
    for (const Command& command :
         {Command(occluder), Command(polygon), Command(ResizeOccluder{text(), point().cwiseAbs()}),
          Command(label), Command(image), Command(sound), Command(trail),
          Command(ExtendTrail{text(), place()}), Command(ShortenTrail{text()}),
          Command(SetLabelOffset{text(), point()}),
          Command(SetEntityText{text(), text(), coin() ? "de" : ""}),
          Command(SetEntityText{text(), "", "es-419"})}) {
      ASSERT_EQ(Validate(command), "") << FormatCommand(command);
      EXPECT_EQ(Parsed(FormatCommand(command)), command) << FormatCommand(command);
    }
  }
}

}  // namespace
}  // namespace docent::app
