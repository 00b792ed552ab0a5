// SPDX-License-Identifier: Apache-2.0
#include "app/visits/visit_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "app/visits/visit_log.h"
#include "app/visits/visit_report.h"
#include "engine/base/random.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/support/error_of.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr std::chrono::sys_seconds kNoon =
    std::chrono::sys_days(std::chrono::year(2026) / 3 / 1) + std::chrono::hours(12);

// A camera with ten images a second, which moves by one unit a second along x.
struct Walker {
  VisitRecorder recorder;
  int image = 0;
  std::vector<VisitRecord> ended;

  void In(const std::string& map, double duration_s) {
    const int end = image + static_cast<int>(std::lround(10 * duration_s));
    for (; image < end; ++image) {
      const double seconds = image / 10.0;
      auto visit = recorder.Add(kNoon + std::chrono::seconds(image / 10), seconds, map, {seconds, 0, 0});
      if (visit) ended.push_back(std::move(*visit));
    }
  }
};

TEST(VisitRecorder, TellsWhereTheVisitorWasAndWhereTheCameraWasLost) {
  Walker walker;
  walker.In("", 3);
  walker.In("Lions", 20);
  walker.In("", 0.5);
  walker.In("Lions", 10);
  walker.In("", 5);
  walker.In("Masks", 10);
  walker.In("", 30);
  const auto visit = walker.recorder.Finish();
  ASSERT_TRUE(visit);
  EXPECT_EQ(visit->begin, kNoon);
  EXPECT_EQ(visit->images, 785u);
  EXPECT_EQ(visit->localized, 400u);
  EXPECT_NEAR(visit->duration_s, 48.4, 1e-9) << "who has left is not there any more";
  ASSERT_THAT(visit->stays, SizeIs(2));
  EXPECT_EQ(visit->stays[0].map, "Lions");
  EXPECT_NEAR(visit->stays[0].begin_s, 3, 1e-9);
  EXPECT_NEAR(visit->stays[0].duration_s, 30.4, 1e-9) << "a short pause does not end a stay";
  EXPECT_EQ(visit->stays[1].map, "Masks");
  ASSERT_THAT(visit->losses, SizeIs(1)) << "neither the short pause nor the end is a loss";
  EXPECT_EQ(visit->losses[0].map, "Lions");
  EXPECT_NEAR(visit->losses[0].begin_s, 33.4, 1e-9);
  EXPECT_NEAR(visit->losses[0].duration_s, 5.1, 1e-9);
  EXPECT_NEAR(visit->losses[0].place.x(), 33.4, 1e-9);
  EXPECT_THAT(visit->path, SizeIs(::testing::AllOf(::testing::Ge(38u), ::testing::Le(44u))))
      << "one a second";
  EXPECT_EQ(visit->path.back().stay, 1u);
  EXPECT_FALSE(walker.recorder.Finish());
}

TEST(VisitRecorder, BeginsTheNextVisitAfterTwoMinutesWithoutAPose) {
  Walker walker;
  walker.In("Lions", 10);
  walker.In("", 119);
  walker.In("Lions", 10);
  EXPECT_THAT(walker.ended, IsEmpty());
  walker.In("", 200);
  ASSERT_THAT(walker.ended, SizeIs(1));
  EXPECT_NEAR(walker.ended[0].duration_s, 138.9, 1e-9);
  walker.In("Masks", 5);
  const auto next = walker.recorder.Finish();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->begin, kNoon + std::chrono::seconds(339)) << "it begins with the next pose";
  EXPECT_EQ(next->images, 50u);
  EXPECT_EQ(next->stays.front().begin_s, 0);
}

TEST(VisitRecorder, ADeviceThatWaitsForItsFirstVisitorHasNone) {
  Walker walker;
  walker.In("", 7200);
  EXPECT_FALSE(walker.recorder.Finish());
  walker.In("", 10);
  walker.In("Lions", 20);
  EXPECT_THAT(walker.ended, IsEmpty());
  const auto visit = walker.recorder.Finish();
  ASSERT_TRUE(visit);
  EXPECT_EQ(visit->begin, kNoon + std::chrono::seconds(7210));
  EXPECT_EQ(visit->images, 200u);
  EXPECT_NEAR(visit->duration_s, 19.9, 1e-9);
}

TEST(VisitRecorder, AVisitThatIsEndedBeforeAnythingWasRecognizedIsNone) {
  Walker walker;
  walker.In("", 10);
  EXPECT_FALSE(walker.recorder.Finish());
  walker.In("", 10);
  walker.In("Lions", 20);
  const auto visit = walker.recorder.Finish();
  ASSERT_TRUE(visit);
  EXPECT_EQ(visit->begin, kNoon + std::chrono::seconds(20)) << "it begins with the first pose";
  EXPECT_EQ(visit->images, 200u);
  walker.In("", 10);
  EXPECT_FALSE(walker.recorder.Finish());
}

TEST(VisitRecorder, StaysWithinItsLimits) {
  VisitRecorder::Limits limits;
  limits.stays = limits.losses = 5;
  limits.steps = 7;
  VisitRecorder recorder(limits);
  for (int i = 0; i < 4000; ++i)
    recorder.Add(kNoon, i * 0.5, i % 8 < 4 ? "map " + std::to_string(i / 8) : std::string(), {0, 0, 0});
  const auto visit = recorder.Finish();
  ASSERT_TRUE(visit);
  EXPECT_THAT(visit->stays, SizeIs(5));
  EXPECT_THAT(visit->losses, SizeIs(5));
  EXPECT_THAT(visit->path, SizeIs(7));
  EXPECT_EQ(visit->images, 4000u);
}

VisitRecord SampleVisit() {
  VisitRecord visit;
  visit.begin = kNoon;
  visit.duration_s = 62.25;
  visit.images = 1800;
  visit.localized = 1700;
  visit.tour = "Highlights <\"1\">";
  visit.stops = 5;
  visit.seen = 4;
  visit.stays = {{"Löwen", 1.5, 30}, {"Masks", 35, 27.25}};
  visit.losses = {{"Löwen", 31.5, 3.5, {1, -2.125, 3}}};
  visit.path = {{0, {1, 2, 3}}, {1, {4, 5, 6.5}}};
  return visit;
}

TEST(VisitLog, KeepsRecordsOfSeveralDevicesByDay) {
  const TemporaryFolder folder;
  VisitRecord next_day = SampleVisit();
  next_day.begin += std::chrono::hours(24);
  {
    VisitLog one(folder / "log"), other(folder / "log");
    other.Add(next_day);
    for (int i = 0; i < 20; ++i) (i % 2 == 0 ? one : other).Add(SampleVisit());
    one.Close();
    other.Close();
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "log/visits-2026-03-01.jsonl"));
  EXPECT_TRUE(std::filesystem::exists(folder / "log/visits-2026-03-02.jsonl"));
  std::vector<std::string> problems;
  const auto visits = ReadVisits(folder / "log", &problems);
  EXPECT_THAT(problems, IsEmpty());
  ASSERT_THAT(visits, SizeIs(21));
  EXPECT_EQ(visits.front(), SampleVisit());
  EXPECT_EQ(visits.back(), next_day);
}

TEST(VisitLog, SaysWhenItCannotBeWritten) {
  const TemporaryFolder folder;
  folder.Write("file", std::string("x"));
  EXPECT_THAT(ErrorOf([&] { VisitLog log(folder / "file"); }), Not(IsEmpty()));
  VisitLog log(folder / "log");
  std::filesystem::remove_all(folder / "log");
  log.Add(SampleVisit());
  EXPECT_THAT(ErrorOf([&] { log.Close(); }), HasSubstr("A visit is missing in the log"));
}

TEST(VisitLog, FailsAtItsEndAlsoWhenTheProblemWasTaken) {
  const TemporaryFolder folder;
  VisitLog log(folder / "log");
  std::filesystem::remove_all(folder / "log");
  log.Add(SampleVisit());
  std::string problem;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
  while ((problem = log.TakeProblem()).empty() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_THAT(problem, HasSubstr("A visit is missing in the log"));
  std::filesystem::create_directory(folder / "log");
  log.Add(SampleVisit());
  EXPECT_EQ(ErrorOf([&] { log.Close(); }), problem);
}

TEST(VisitLog, LosesOnlyTheLinesThatCannotBeRead) {
  const TemporaryFolder folder;
  const std::string good = VisitToJson(SampleVisit());
  folder.Write("visits-2026-03-01.jsonl", good + "\n" + good.substr(0, 200) + "\n\n{}\n[1]\nnull\n" + good);
  std::vector<std::string> problems;
  EXPECT_THAT(ReadVisits(folder / "", &problems), SizeIs(2));
  EXPECT_THAT(problems, ElementsAre(HasSubstr("line 2"), HasSubstr("line 4"), HasSubstr("line 5"),
                                    HasSubstr("line 6")));
  EXPECT_THAT(ErrorOf([&] { ReadVisits(folder / "none", &problems); }), HasSubstr("Cannot read the folder"));
}

TEST(VisitLog, BeginsANewLineAfterOneThatAFullDiskHasCutOff) {
  const TemporaryFolder folder;
  folder.Write("visits-2026-03-01.jsonl", VisitToJson(SampleVisit()).substr(0, 200));
  {
    VisitLog log(folder / "");
    log.Add(SampleVisit());
    log.Close();
  }
  std::vector<std::string> problems;
  EXPECT_THAT(ReadVisits(folder / "", &problems), ElementsAre(SampleVisit()));
  EXPECT_THAT(problems, ElementsAre(HasSubstr("line 1")));
}

// A changed byte gives another record or a sentence, never a crash; what is read can be written and read
// again.
TEST(VisitLog, SurvivesDamagedLines) {
  const std::string good = VisitToJson(SampleVisit());
  Random random(5);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (std::uint32_t n = 1 + random.Below(3); n > 0; --n)
      text[random.Below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(random.Below(256));
    const std::string problem = ErrorOf([&] {
      const VisitRecord visit = VisitFromJson(text, "here");
      VisitFromJson(VisitToJson(visit), "again");
      FormatVisitReport({visit}, "damaged");
    });
    EXPECT_THAT(problem, Not(HasSubstr("again"))) << text;
    refused += !problem.empty();
  }
  EXPECT_GT(refused, 1000);
}

TEST(VisitReport, PutsTheMapInWhichVisitorsAreLostMostOftenFirst) {
  VisitRecord good, bad;
  good.stays = {{"Lions", 0, 600}, {"Masks", 600, 60}, {"Lions", 660, 600}};
  good.losses = {{"Lions", 600, 2, {0, 0, 0}}};
  bad.stays = {{"Masks", 0, 120}};
  bad.losses = {{"Masks", 10, 4, {0, 0, 0}}, {"Masks", 50, 9, {0, 0, 0}}};
  const auto maps = MapsByCare({good, bad});
  ASSERT_THAT(maps, SizeIs(2));
  EXPECT_EQ(maps[0].map, "Masks");
  EXPECT_EQ(maps[0].visits, 2u);
  EXPECT_EQ(maps[0].losses, 2u);
  EXPECT_EQ(maps[0].longest_loss_s, 9);
  EXPECT_NEAR(maps[0].LossesPerHour(), 2 * 3600 / 180.0, 1e-9);
  EXPECT_EQ(maps[1].map, "Lions");
  EXPECT_EQ(maps[1].visits, 1u);
  EXPECT_EQ(maps[1].median_s, 1200);
}

TEST(VisitReport, ShowsTextsAsTheyAreAndNothingElse) {
  const std::string page = FormatVisitReport({SampleVisit()}, "Visits in <museum>");
  EXPECT_THAT(page, HasSubstr("Visits in &lt;museum&gt;"));
  EXPECT_THAT(page, HasSubstr("Highlights &lt;&quot;1&quot;&gt;"));
  EXPECT_THAT(page, HasSubstr("Löwen"));
  EXPECT_THAT(page, HasSubstr("2026-03-01"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(FormatVisitReport({}, "None"), HasSubstr("There were no visits."));
}

}  // namespace
}  // namespace docent::app
