// SPDX-License-Identifier: Apache-2.0
#include "app/session/narration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <optional>
#include <thread>

#include "app/files/text_file.h"
#include "app/sound/speech.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A visitor who sees the same at 30 images a second until something is changed.
struct Listener {
  Narration narration{VisitorStringsFor("en")};
  ui::VisitorDisplay display;
  std::optional<ShownWay> way;
  std::vector<ReadableSign> signs;
  double seconds = 0;

  // Everything that is spoken during this time.
  std::vector<std::string> Hear(double duration_s) {
    std::vector<std::string> heard;
    for (const double end = seconds + duration_s; seconds < end; seconds += 1.0 / 30) {
      const Narration::Seen seen{
          .seconds = seconds, .display = &display, .way = way ? &*way : nullptr, .signs = signs};
      for (const std::string& text : narration.Update(seen)) heard.push_back(text);
    }
    return heard;
  }
};

TEST(Narration, SaysWhatToDoOnceWhileItStays) {
  Listener listener;
  listener.display.sentence = "Look around slowly.";
  EXPECT_THAT(listener.Hear(0.9), IsEmpty()) << "it may change at once";
  EXPECT_THAT(listener.Hear(60), ElementsAre("Look around slowly."));
}

TEST(Narration, SaysTheEndOfATourOnce) {
  Listener listener;
  listener.display.sentence = listener.display.route_line = "The tour ends here.";
  EXPECT_THAT(listener.Hear(8), ElementsAre("The tour ends here."));
  listener.display.sentence.clear();
  EXPECT_THAT(listener.Hear(60), IsEmpty());
}

TEST(Narration, ReadsEachPageOfACardAtOnceAndEachOpenedCardAnew) {
  Listener listener;
  listener.display.card.emplace().text = "First page.";
  EXPECT_THAT(listener.Hear(5), ElementsAre("First page."));
  listener.display.card->text = "Second page.";
  EXPECT_THAT(listener.Hear(5), ElementsAre("Second page."));
  listener.display.card.reset();
  EXPECT_THAT(listener.Hear(5), IsEmpty());
  listener.display.card.emplace().text = "First page.";
  EXPECT_THAT(listener.Hear(5), ElementsAre("First page."));
}

TEST(Narration, LeavesOutSentencesThatFlicker) {
  Listener listener;
  std::vector<std::string> heard;
  for (int i = 0; i < 40; ++i) {
    listener.display.sentence = i % 2 == 0 ? "Move more slowly." : "";
    for (const std::string& text : listener.Hear(0.4)) heard.push_back(text);
  }
  EXPECT_THAT(heard, IsEmpty());
}

TEST(Narration, RepeatsASentenceThatComesBackOnlyAfterAWhile) {
  Listener listener;
  listener.display.sentence = "Move more slowly.";
  EXPECT_THAT(listener.Hear(2), ElementsAre("Move more slowly."));
  listener.display.sentence.clear();
  EXPECT_THAT(listener.Hear(2), IsEmpty());
  listener.display.sentence = "Move more slowly.";
  EXPECT_THAT(listener.Hear(5), IsEmpty()) << "it was said a moment ago";
  EXPECT_THAT(listener.Hear(20), ElementsAre("Move more slowly."));
}

TEST(Narration, NamesAPlaceOnArrivalAndThenWhatCanBeReadThere) {
  Listener listener;
  listener.display.place = "Lions";
  listener.display.route_line = "Stop 1 of 2. Next: Masks";
  listener.signs = {{"label-1", "Ivory, about 1900"}, {"sign-1", "To the masks"}};
  EXPECT_THAT(listener.Hear(10),
              ElementsAre("Lions", "Stop 1 of 2. Next: Masks", "Ivory, about 1900", "To the masks"));
  listener.signs.clear();
  EXPECT_THAT(listener.Hear(5), IsEmpty());
  listener.signs = {{"label-1", "Ivory, about 1900"}};
  EXPECT_THAT(listener.Hear(5), IsEmpty()) << "it was read at this visit";
  listener.display.place = "Masks";
  EXPECT_THAT(listener.Hear(5), ElementsAre("Masks", "Ivory, about 1900"));
}

TEST(Narration, SaysOnWhichSideTheWayIs) {
  for (const auto& [degrees, expected] :
       std::vector<std::pair<double, std::string>>{{0, "Straight ahead: To Masks"},
                                                   {40, "Straight ahead: To Masks"},
                                                   {80, "On the right: To Masks"},
                                                   {-80, "On the left: To Masks"},
                                                   {170, "Behind you: To Masks"}}) {
    Listener listener;
    const double angle = degrees * std::numbers::pi / 180;
    listener.way.emplace();
    listener.way->towards = {std::sin(angle), 0, std::cos(angle)};  // x to the right, z ahead
    listener.way->drawn.text = "To Masks";
    EXPECT_THAT(listener.Hear(10), ElementsAre(expected)) << degrees;
  }
}

content::Entity LabelAt(const std::string& name, const Eigen::Vector3d& place) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kLabel;
  entity.name = name;
  entity.label.text = "text of " + name;
  entity.label.translations = {{"de", "Text von " + name}};
  entity.label.anchor = place;
  entity.label.text_height = 0.02;
  return entity;
}

TEST(SignsInView, AreThoseThatAreLargeEnoughToBeRead) {
  engine::CameraModel::Intrinsics in;
  in.width_px = 640;
  in.height_px = 480;
  in.fx = in.fy = 500;
  in.cx = 319.5;
  in.cy = 239.5;
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, in, {});
  content::Scene scene;
  // A letter of 2 cm is seen under 0.4 degrees from 2.86 m.
  scene.entities = {LabelAt("near", {0, 0, 2.8}), LabelAt("far", {0, 0, 2.9}), LabelAt("behind", {0, 0, -1}),
                    LabelAt("aside", {5, 0, 1}), LabelAt("hidden", {0, 0, 1})};
  scene.entities.back().hidden = true;
  const auto signs = SignsInView(scene, camera, {}, "de-at");
  ASSERT_EQ(signs.size(), 1u);
  EXPECT_EQ(signs.front().entity, "near");
  EXPECT_EQ(signs.front().text, "Text von near");
}

// A program called spd-say in a folder of its own, which is searched first.
class SpeechProgram : public ::testing::Test {
 protected:
  void SetUp() override { path_ = std::getenv("PATH") != nullptr ? std::getenv("PATH") : ""; }
  void TearDown() override { setenv("PATH", path_.c_str(), 1); }
  void Install(const std::string& script) {
    const auto program = folder_.Write("spd-say", "#!/bin/sh\n" + script);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv("PATH", (program.parent_path().string() + ":" + path_).c_str(), 1);
  }
  // The problem that is reported, waiting for it.
  static std::string AwaitProblem(Speech* speech) {
    std::string problem;
    for (int i = 0; i < 6000 && problem.empty(); ++i) {
      problem = speech->TakeProblem();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return problem;
  }

  const TemporaryFolder folder_;
  std::string path_;
};

TEST_F(SpeechProgram, GetsTheTextsInTheirOrder) {
  const std::filesystem::path said = folder_ / "said";
  Install("shift 3; echo \"$@\" >>" + said.string() + "\n");
  Speech speech("de");
  speech.Say("Löwen");
  speech.Say("--version; \"Masken\" $HOME");
  std::string text;
  for (int i = 0; i < 6000 && std::count(text.begin(), text.end(), '\n') < 2; ++i) {
    if (std::filesystem::exists(said)) text = ReadTextFile(said);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(text, "de -- Löwen\nde -- --version; \"Masken\" $HOME\n");
  EXPECT_EQ(speech.TakeProblem(), "");
}

TEST_F(SpeechProgram, FailsOnceWithASentence) {
  Install("exit 1\n");
  Speech speech("en");
  for (int i = 0; i < 100; ++i) speech.Say("Lions");
  EXPECT_EQ(AwaitProblem(&speech), "Nothing is spoken: there is no speech service.");
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(speech.TakeProblem(), "");
}

TEST_F(SpeechProgram, DoesNotKeepATourFromEndingWhenItHangs) {
  const auto started = folder_ / "started";
  Install(": >'" + started.string() + "'\nexec sleep 600\n");
  std::optional<Speech> speech(std::in_place, "en");
  for (int i = 0; i < 3; ++i) speech->Say("Lions");
  ASSERT_TRUE(WaitUntil([&] { return std::filesystem::exists(started); }));
  const auto begin = std::chrono::steady_clock::now();
  speech.reset();
  // A program that does not answer is ended after ten seconds in any case.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(SpeechProgram, AMissingProgramIsReported) {
  setenv("PATH", (folder_ / "").c_str(), 1);
  Speech speech("en");
  speech.Say("Lions");
  EXPECT_EQ(AwaitProblem(&speech), "Nothing is spoken: Speech Dispatcher is not installed (spd-say).");
}

}  // namespace
}  // namespace docent::app
