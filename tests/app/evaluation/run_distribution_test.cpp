// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/run_distribution.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/evaluation/distribution_section.h"
#include "app/evaluation/html_report.h"
#include "app/evaluation/json_report.h"

namespace docent::app {
namespace {

using engine::TrackingState;
using ::testing::DoubleNear;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Optional;

const Figure& FigureOf(const std::string& name) {
  const auto figures = Figures();
  return *std::find_if(figures.begin(), figures.end(), [&](const Figure& f) { return f.name == name; });
}

RunRow Row(std::uint64_t seed, double share, std::optional<double> ate_m) {
  RunRow row;
  row.key = {.seed = seed};
  row.frames = 100;
  row.tracked = static_cast<int>(share * 100);
  row.tracked_share = share;
  row.ate_m = ate_m;
  row.false_starts = seed == 3 ? 2 : 0;
  row.noticed = seed == 3 ? 1 : 0;
  return row;
}

RunDistribution FourRuns() {
  RunDistribution distribution;
  distribution.name = "drone<1>";
  distribution.engine = "hybrid";
  distribution.seeds = 4;
  distribution.has_truth = true;
  distribution.rows = {Row(1, 0.9, 0.02), Row(2, 0.95, 0.05), Row(3, 0.1, std::nullopt), Row(4, 1, 0.03)};
  return distribution;
}

FrameRecord FrameAt(int index, TrackingState state, std::uint64_t map_key) {
  FrameRecord frame;
  frame.time = std::chrono::seconds(5) + std::chrono::milliseconds(100) * index;
  frame.state = state;
  frame.map_key = map_key;
  return frame;
}

TEST(RunDistribution, ReportsMinimumMedianMaximumAndWorstRun) {
  const RunDistribution runs = FourRuns();
  const auto share = SpreadOf(FigureOf("tracked_share"), runs.rows);
  ASSERT_TRUE(share);
  EXPECT_EQ(share->runs, 4);
  EXPECT_DOUBLE_EQ(share->min, 0.1);
  EXPECT_DOUBLE_EQ(share->median, 0.925) << "the mean of the two middle values";
  EXPECT_DOUBLE_EQ(share->max, 1);
  EXPECT_EQ(share->worst, 2u) << "the run with the lowest ratio";
  const auto ate = SpreadOf(FigureOf("ate_rmse_m"), runs.rows);
  ASSERT_TRUE(ate);
  EXPECT_EQ(ate->runs, 3) << "one run has no ATE";
  EXPECT_DOUBLE_EQ(ate->median, 0.03);
  EXPECT_EQ(ate->worst, 1u) << "the run with the largest error";
  EXPECT_DOUBLE_EQ(SpreadOf(FigureOf("unnoticed_false_starts"), runs.rows)->max, 1);
  EXPECT_FALSE(SpreadOf(FigureOf("first_3d_pose_s"), runs.rows));
  EXPECT_EQ(WorstRun(runs.rows), 2u);
}

TEST(RunDistribution, CountsNoFalseInitializationsWhereTheTruthDecidesOnNone) {
  InitializationResult undecided, right;
  undecided.outcome = InitializationOutcome::kUndecided;
  right.outcome = InitializationOutcome::kRight;
  const auto row = [](std::vector<InitializationResult> starts) {
    return MakeRunRow({}, RunRecord(), SequenceReport(), std::move(starts));
  };
  EXPECT_FALSE(row({undecided, undecided}).false_starts);
  EXPECT_FALSE(row({undecided, undecided}).noticed);
  EXPECT_EQ(row({undecided, undecided}).initializations.size(), 2u);
  EXPECT_EQ(row({undecided, right}).false_starts, 0);
  EXPECT_EQ(row({}).false_starts, 0) << "no map was initialized";
}

TEST(RunDistribution, WorstOfEquallyTrackedRunsHasTheLargerError) {
  EXPECT_EQ(WorstRun({Row(1, 0.9, 0.02), Row(2, 0.9, 0.05), Row(4, 1, 0.3)}), 1u);
}

TEST(RunDistribution, CountsAllFramesOfTheWindowAndAllKeptMaps) {
  RunRecord run;
  run.frames.push_back(FrameAt(0, TrackingState::kInitializing, 0));
  run.frames.push_back(FrameAt(1, TrackingState::kPanorama, 1));
  run.frames.back().map_points.infinite = 10;  // infinite points only
  run.frames.push_back(FrameAt(2, TrackingState::kSixDof, 2));
  run.frames.push_back(FrameAt(3, TrackingState::kSixDof, 1));
  run.frames.push_back(FrameAt(4, TrackingState::kLost, 1));
  run.frames.push_back(FrameAt(5, TrackingState::kSixDof, 3));
  run.frames.push_back(FrameAt(6, TrackingState::kDropped, 0));
  for (const std::uint64_t key : {1, 2, 3}) {
    MapRecord map;
    map.key = key;
    map.discarded = key == 2;
    run.maps.push_back(map);
  }
  InitializationResult noticed;
  noticed.outcome = InitializationOutcome::kFalsePath;
  noticed.discarded = true;
  InitializationResult right;
  right.outcome = InitializationOutcome::kRight;
  const SequenceReport report = EvaluateRun(run, {}, {});
  const RunRow row = MakeRunRow({7, 2, 30}, run, report, {{noticed, right}});
  EXPECT_EQ(row.key.seed, 7u);
  EXPECT_EQ(row.frames, 7);
  EXPECT_EQ(row.tracked, 3);
  EXPECT_DOUBLE_EQ(row.tracked_share, 3.0 / 7);
  EXPECT_THAT(row.first_3d_pose_s, Optional(DoubleNear(0.3, 1e-9))) << "frame 2 is in a discarded map";
  EXPECT_EQ(row.maps, 2);
  EXPECT_EQ(row.discarded_maps, 1);
  EXPECT_EQ(row.false_starts, 1);
  EXPECT_EQ(row.noticed, 1);
  const RunRow without_truth = MakeRunRow({7, 2, 30}, run, report, std::nullopt);
  EXPECT_FALSE(without_truth.false_starts);
  EXPECT_FALSE(without_truth.ate_m);
}

TEST(RunDistribution, AlignsEachFrameWithItsOwnMap) {
  RunRecord run;
  std::vector<TimedPose> truth;
  // Two maps of one path, whose scales differ by a factor of ten.
  for (int i = 0; i < 24; ++i) {
    run.frames.push_back(FrameAt(i, TrackingState::kSixDof, i < 12 ? 1 : 2));
    const Eigen::Vector3d center(i, i * i * 0.1, 1);
    truth.push_back({run.frames.back().time, {engine::Rotation3(), center}});
    const double scale = i < 12 ? 1 : 10;
    run.frames.back().camera_from_map = engine::Rigid3(engine::Rotation3(), center * scale).inverse();
  }
  const RunRow row =
      MakeRunRow({}, run, EvaluateRun(run, truth, {}), ClassifyInitializations(run, truth, {}));
  EXPECT_THAT(row.ate_m, Optional(DoubleNear(0, 1e-9)));
  EXPECT_THAT(row.rotation_deg, Optional(DoubleNear(0, 1e-6)));
  EXPECT_EQ(row.maps, 2);
}

TEST(RunDistribution, IsAnEmptyRowWithoutFrames) {
  const RunRow row = MakeRunRow({}, {}, EvaluateRun({}, {}, {}), std::nullopt);
  EXPECT_EQ(row.tracked_share, 0);
  EXPECT_FALSE(row.first_3d_pose_s);
}

TEST(RunDistribution, TableNamesTheWorstRun) {
  const std::string table = FormatTable(FourRuns());
  EXPECT_THAT(table, HasSubstr("drone<1>, hybrid: 4 runs (4 seeds, 1 start)"));
  EXPECT_THAT(table, HasSubstr("10.0 %     92.5 %    100.0 %     4  seed 3\n"));
  EXPECT_THAT(table,
              HasSubstr("false initializations in 1 of 4 runs: 2 in total, 1 of them noticed; 0 undecided"));
  EXPECT_THAT(table, HasSubstr("worst run: drone<1>, seed 3: tracked frames 10.0 %"));
  RunDistribution windows = FourRuns();
  windows.starts = 2;
  windows.window_s = 15;
  EXPECT_THAT(FormatTable(windows), HasSubstr("2 starts, 15 s each"));
  EXPECT_THAT(FormatTable(windows), HasSubstr("seed 3, start 0"));
}

TEST(RunDistribution, TableOmitsErrorsWithoutGroundTruth) {
  RunDistribution runs = FourRuns();
  runs.has_truth = false;
  for (RunRow& row : runs.rows) {
    row.ate_m.reset();
    row.false_starts.reset();
    row.noticed.reset();
  }
  EXPECT_THAT(FormatTable(runs), HasSubstr("unknown without ground truth"));
  EXPECT_THAT(FormatRunLine(runs.rows[0], runs), Not(HasSubstr("ATE")));
}

TEST(RunDistribution, JsonReportContainsEveryRun) {
  const auto json = nlohmann::json::parse(FormatJsonReport({FourRuns()}, {}));
  const auto& sequence = json["sequences"][0];
  EXPECT_EQ(sequence["name"], "drone<1>");
  const auto& distribution = sequence["distribution"];
  EXPECT_EQ(distribution["seeds"], 4);
  EXPECT_TRUE(distribution["window_s"].is_null());
  EXPECT_EQ(distribution["figures"]["tracked_share"]["worst"]["seed"], 3);
  EXPECT_DOUBLE_EQ(distribution["figures"]["tracked_share"]["median"], 0.925);
  EXPECT_TRUE(distribution["figures"]["first_3d_pose_s"].is_null());
  EXPECT_EQ(distribution["worst"]["seed"], 3);
  ASSERT_EQ(distribution["runs"].size(), 4u);
  EXPECT_EQ(distribution["runs"][2]["false_starts"], 2);
  EXPECT_EQ(distribution["runs"][2]["noticed_false_starts"], 1);
  EXPECT_TRUE(distribution["runs"][2]["ate_rmse_m"].is_null());
  EXPECT_FALSE(json.contains("compared"));
}

TEST(RunDistribution, IsPlottedFromTheWorstRunToTheBest) {
  const std::string html = FormatHtmlReport(std::vector{FourRuns()});
  EXPECT_THAT(html, HasSubstr("drone&lt;1&gt;, hybrid"));
  EXPECT_THAT(html, HasSubstr("Worst run: seed 3."));
  EXPECT_THAT(html, HasSubstr("tracked frames of each run, sorted"));
  EXPECT_THAT(html, HasSubstr("ATE of each run, sorted"));
  EXPECT_THAT(html, Not(HasSubstr("first 3D pose after of each run"))) << "no run has one";
}

}  // namespace
}  // namespace docent::app
