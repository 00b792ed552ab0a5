// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/evaluate_run.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/evaluation/html_report.h"
#include "app/evaluation/json_report.h"
#include "app/evaluation/run_distribution.h"
#include "tests/app/support/known_run.h"
#include "tests/app/support/rad_per_degree.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using engine::TrackingState;
using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Optional;

// A camera that moves along a rising helix and rotates.
std::vector<TimedPose> Helix(int count) {
  std::vector<TimedPose> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = 0.1 * i;
    poses.push_back({TimeOf(i),
                     {engine::Rotation3::Exp({0.02 * i, 0.03 * i, -0.01 * i}),
                      Eigen::Vector3d(2 * std::cos(angle), 0.05 * i, 2 * std::sin(angle))}});
  }
  return poses;
}

FrameRecord PerfectFrame(const TimedPose& truth, std::uint64_t map_key = 1) {
  FrameRecord frame;
  frame.time = truth.time;
  frame.state = TrackingState::kSixDof;
  frame.map_key = map_key;
  frame.tracking_ms = 4;
  frame.camera_from_map = CameraFromMap(truth.truth_from_camera);
  return frame;
}

RunRecord PerfectRun(const std::vector<TimedPose>& truth) {
  RunRecord run;
  run.name = "helix";
  for (const TimedPose& pose : truth) run.frames.push_back(PerfectFrame(pose));
  return run;
}

void MoveInTruth(FrameRecord* frame, const Eigen::Vector3d& by) {
  engine::Rigid3 map_from_camera = frame->camera_from_map.inverse();
  map_from_camera.translation += kTruthFromMap.rotation.inverse() * by / kTruthFromMap.scale;
  frame->camera_from_map = map_from_camera.inverse();
}

TEST(Evaluation, PerfectRunHasTheExactSimilarityAndNoError) {
  const auto truth = Helix(60);
  const SequenceReport report = EvaluateRun(PerfectRun(truth), truth, {});
  EXPECT_THAT(report.ate_rmse_m, Optional(DoubleNear(0, 1e-9)));
  EXPECT_THAT(report.scale, Optional(DoubleNear(2.5, 1e-9)));
  EXPECT_THAT(report.rotation_rmse_deg, Optional(DoubleNear(0, 1e-5)));
  EXPECT_THAT(report.rotation_drift_deg, Optional(DoubleNear(0, 1e-5)));
  EXPECT_EQ(report.tracked_ratio, 1);
  EXPECT_EQ(report.first_tracked_frame, 0);
}

TEST(Evaluation, MeasuresAKnownAte) {
  const auto truth = Helix(400);
  RunRecord run = PerfectRun(truth);
  // Errors of 5 cm with alternating signs do not change the best similarity, up to second order.
  for (std::size_t i = 0; i < run.frames.size(); ++i)
    MoveInTruth(&run.frames[i], {0, i % 2 == 0 ? 0.05 : -0.05, 0});
  EXPECT_THAT(EvaluateRun(run, truth, {}).ate_rmse_m, Optional(DoubleNear(0.05, 5e-4)));
}

TEST(Evaluation, MeasuresTheAteOfAdjustedKeyframesAndOfLivePoses) {
  const auto truth = Helix(400);
  RunRecord run = PerfectRun(truth);
  for (std::size_t i = 0; i < run.frames.size(); ++i)
    MoveInTruth(&run.frames[i], {0, i % 2 == 0 ? 0.05 : -0.05, 0});
  EXPECT_FALSE(EvaluateRun(run, truth, {}).maps.at(0).keyframe_ate_rmse_m)
      << "there are no adjusted keyframes";
  MapRecord map;
  map.key = 1;
  for (std::size_t i = 0; i < truth.size(); i += 20) {
    FrameRecord keyframe = PerfectFrame(truth[i]);
    MoveInTruth(&keyframe, {0, i % 40 == 0 ? 0.01 : -0.01, 0});
    map.adjusted_centers.emplace_back(keyframe.time, keyframe.camera_from_map.OriginInSource());
  }
  run.maps.push_back(map);
  const MapResult result = EvaluateRun(run, truth, {}).maps.at(0);
  EXPECT_THAT(result.ate_rmse_m, Optional(DoubleNear(0.05, 5e-4)));
  EXPECT_THAT(result.keyframe_ate_rmse_m, Optional(DoubleNear(0.01, 1e-3)));
}

TEST(Evaluation, MeasuresRotationErrorAndDriftSeparately) {
  const auto truth = Helix(201);
  RunRecord run = PerfectRun(truth);
  // A rotation error about the camera's x axis grows linearly to 4 degrees over the run; the alignment halves
  // the largest error.
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const double angle = 4 * kRadPerDegree * static_cast<double>(i) / 200;
    engine::Rigid3& pose = run.frames[i].camera_from_map;
    pose = engine::Rigid3(engine::Rotation3::Exp({angle, 0, 0}), Eigen::Vector3d::Zero()) * pose;
  }
  const SequenceReport report = EvaluateRun(run, truth, {});
  EXPECT_THAT(report.rotation_drift_deg, Optional(DoubleNear(4, 1e-6)));
  ASSERT_TRUE(report.rotation_rmse_deg);
  EXPECT_GT(*report.rotation_rmse_deg,
            1.0);  // a uniform distribution over 4 degrees has sigma 4 / sqrt(12) = 1.15
  EXPECT_LT(*report.rotation_rmse_deg, 2.4);  // without alignment: 4 / sqrt(3) = 2.3
}

// The experiment of hybrid-slam §7.3: the error about the axis that the camera rotated about.
TEST(Evaluation, MeasuresTheErrorOfThePureRotation) {
  const auto run_with = [](double turned_deg, double roll_deg) {
    std::vector<TimedPose> truth;
    RunRecord run;
    for (int i = 0; i <= 90; ++i) {
      truth.push_back(
          {TimeOf(i), {engine::Rotation3::Exp({0, i * kRadPerDegree, 0}), Eigen::Vector3d::Zero()}});
      TimedPose estimated = truth.back();
      const double part = i / 90.0;
      estimated.truth_from_camera.rotation =
          engine::Rotation3::Exp({0, turned_deg * part * kRadPerDegree, 0}) *
          engine::Rotation3::Exp({0, 0, roll_deg * part * kRadPerDegree});
      run.frames.push_back(PerfectFrame(estimated));
    }
    return EvaluateRun(run, truth, {});
  };
  EXPECT_THAT(run_with(90, 0).axis_drift_deg, Optional(DoubleNear(0, 1e-5)));
  EXPECT_THAT(run_with(94, 0).axis_drift_deg, Optional(DoubleNear(4, 1e-5)));
  EXPECT_THAT(run_with(87.5, 0).axis_drift_deg, Optional(DoubleNear(-2.5, 1e-5)));
  EXPECT_THAT(run_with(94, 0).maps.at(0).axis_drift_deg, Optional(DoubleNear(4, 1e-5)));
  // A roll about another axis is drift, but not an error of this rotation.
  EXPECT_THAT(run_with(90, 3).axis_drift_deg, Optional(DoubleNear(0, 0.01)));
  EXPECT_THAT(run_with(90, 3).rotation_drift_deg, Optional(DoubleNear(3, 1e-5)));
  // If tracking is lost at frame 60 of 90, the result covers only part of the rotation, and the report says
  // so.
  RunRecord lost;
  std::vector<TimedPose> truth;
  for (int i = 0; i <= 90; ++i) {
    truth.push_back(
        {TimeOf(i), {engine::Rotation3::Exp({0, i * kRadPerDegree, 0}), Eigen::Vector3d::Zero()}});
    lost.frames.push_back(PerfectFrame(truth.back()));
    if (i > 60) lost.frames.back().state = TrackingState::kLost;
  }
  EvaluatedRun evaluated{lost, truth, {}, EvaluateRun(lost, truth, {})};
  EXPECT_EQ(evaluated.report.last_tracked_frame, 60);
  EXPECT_THAT(FormatHtmlReport({evaluated}), HasSubstr("° at frame 60<"));
  // So it does if the camera is tracked in another, smaller map to the end.
  for (std::size_t i = 71; i <= 90; ++i) lost.frames[i] = PerfectFrame(truth[i], 2);
  evaluated = {lost, truth, {}, EvaluateRun(lost, truth, {})};
  EXPECT_EQ(evaluated.report.last_tracked_frame, 90);
  EXPECT_THAT(FormatHtmlReport({evaluated}), HasSubstr("° at frame 60<"));
  auto back = Helix(30);
  for (TimedPose& pose : back) pose.truth_from_camera.rotation = engine::Rotation3();
  EXPECT_FALSE(EvaluateRun(PerfectRun(back), back, {}).axis_drift_deg);
}

TEST(Evaluation, CountsFramesWithAPoseFromTheFirstTrackedFrame) {
  const auto truth = Helix(10);
  RunRecord run = PerfectRun(truth);
  run.frames[0].state = run.frames[1].state = TrackingState::kInitializing;
  run.frames[5].state = TrackingState::kLost;
  run.frames[6].state = TrackingState::kRelocalized;
  run.frames[7].state = TrackingState::kPanorama;
  run.frames[8].state = TrackingState::kDropped;
  const SequenceReport report = EvaluateRun(run, truth, {});
  EXPECT_EQ(report.frames, 10);
  EXPECT_EQ(report.tracked, 6);
  EXPECT_EQ(report.first_tracked_frame, 2);
  EXPECT_EQ(report.last_tracked_frame, 9);
  EXPECT_DOUBLE_EQ(report.tracked_ratio, 6.0 / 8);
  EXPECT_EQ(report.relocalizations, 1);
}

TEST(Evaluation, CountsFramesOfDiscardedMapsAsUntracked) {
  const auto truth = Helix(50);
  RunRecord run = PerfectRun(truth);
  for (int i = 0; i < 30; ++i) run.frames[static_cast<std::size_t>(i)].map_key = 9;
  run.maps = {{1, "kept", false, {}, {3, 0, 0}, {100, 0, 0}, {}},
              {9, "false start", true, {}, {2, 0, 0}, {50, 0, 0}, {}}};
  const SequenceReport report = EvaluateRun(run, truth, {});
  EXPECT_EQ(report.tracked, 20);
  EXPECT_EQ(report.discarded_frames, 30);
  EXPECT_EQ(report.first_tracked_frame, 30);
  EXPECT_EQ(report.keyframes.sixdof, 3);
  ASSERT_TRUE(report.largest_map);
  EXPECT_EQ(report.maps[*report.largest_map].name, "kept");
  EXPECT_THAT(FormatSummary(report), HasSubstr("30 frames in maps discarded later"));
}

TEST(Evaluation, AlignsFramesOfAJoinedMapSeparately) {
  const auto truth = Helix(50);
  RunRecord run = PerfectRun(truth);
  const engine::Rigid3 moved(engine::Rotation3::Exp({0, 0.5, 0}), {1, 2, 3});
  for (int i = 0; i < 20; ++i) {
    FrameRecord& frame = run.frames[static_cast<std::size_t>(i)];
    frame.map_key = 9;
    frame.camera_from_map = frame.camera_from_map * moved;
  }
  run.maps = {{1, "kept", false, {}, {5, 0, 0}, {100, 0, 0}, {}},
              {9, "taken in", false, "kept", {2, 0, 0}, {50, 0, 0}, {}}};
  const SequenceReport report = EvaluateRun(run, truth, {});
  EXPECT_EQ(report.tracked, 50);
  EXPECT_EQ(report.keyframes.sixdof, 5) << "includes those of the joined map";
  ASSERT_EQ(report.maps.size(), 2u);
  EXPECT_EQ(report.maps[0].joined_into, "kept");
  EXPECT_LT(report.maps[0].ate_rmse_m.value(), 1e-6);
  EXPECT_LT(report.maps[1].ate_rmse_m.value(), 1e-6);
  EXPECT_EQ(MakeRunRow({}, run, report, std::nullopt).maps, 1);
}

TEST(Evaluation, AlignsEveryMapSeparatelyAndReportsTheLargest) {
  const auto truth = Helix(100);
  RunRecord run = PerfectRun(truth);
  for (std::size_t i = 60; i < 100;
       ++i) {  // the second map has another coordinate frame, and errors of 10 cm
    run.frames[i].map_key = 2;
    MoveInTruth(&run.frames[i], {5, i % 2 == 0 ? 0.1 : -0.1, 5});
  }
  const SequenceReport report = EvaluateRun(run, truth, {{TimeOf(0), "build"}, {TimeOf(60), "visit"}});
  ASSERT_EQ(report.maps.size(), 2u);
  EXPECT_THAT(report.ate_rmse_m, Optional(DoubleNear(0, 1e-9)));
  EXPECT_THAT(report.maps[1].ate_rmse_m, Optional(DoubleNear(0.1, 0.01)));
  ASSERT_EQ(report.segments.size(), 2u);
  EXPECT_THAT(FormatSummary(report), HasSubstr("deg (of the largest of 2 maps), "));
  EXPECT_THAT(FormatSummary(EvaluateRun(PerfectRun(truth), truth, {})), Not(HasSubstr("largest")));
  EXPECT_EQ(report.segments[1].label, "visit");
  EXPECT_EQ(report.segments[1].frames, 40);
  EXPECT_EQ(report.segments[1].tracked_ratio, 1);
  EXPECT_THAT(report.segments[1].ate_rmse_m, Optional(DoubleNear(0.1, 0.01)));
  EXPECT_THAT(report.segments[0].ate_rmse_m, Optional(DoubleNear(0, 1e-9)));
}

// The first frames rotate about an unknown position in a map without finite points, so that their positions
// are meaningless.
TEST(Evaluation, IgnoresPositionsInAMapWithoutFinitePoints) {
  const auto truth = Helix(120);
  RunRecord run = PerfectRun(truth);
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    FrameRecord& frame = run.frames[i];
    frame.map_points = {i < 40 ? 0 : 500, 200, 0};
    // Later panorama frames within a map that has finite points do have a known position.
    if (i < 40 || i > 100) frame.state = TrackingState::kPanorama;
    if (i < 40) MoveInTruth(&frame, {7, -3, 1});
  }
  run.frames[10].state = TrackingState::kRelocalized;
  // Rotations are evaluated anyway: frame 5 has an error of one degree.
  engine::Rigid3& pose = run.frames[5].camera_from_map;
  pose = engine::Rigid3(engine::Rotation3::Exp({kRadPerDegree, 0, 0}), Eigen::Vector3d::Zero()) * pose;
  const SequenceReport report = EvaluateRun(run, truth, {{TimeOf(0), "start"}, {TimeOf(40), "walk"}});
  EXPECT_EQ(report.tracked, 120);
  EXPECT_EQ(report.tracked_ratio, 1);
  EXPECT_EQ(report.directions_only_frames, 40);
  EXPECT_THAT(report.ate_rmse_m, Optional(DoubleNear(0, 1e-9)));
  EXPECT_THAT(report.scale, Optional(DoubleNear(2.5, 1e-9)));
  EXPECT_FALSE(report.frame_results[39].position_error_m);
  EXPECT_TRUE(report.frame_results[40].position_error_m);
  EXPECT_TRUE(report.frame_results[110].position_error_m);
  ASSERT_TRUE(report.frame_results[5].rotation_error_deg);
  EXPECT_NEAR(*report.frame_results[5].rotation_error_deg, 1, 0.02);
  EXPECT_FALSE(report.segments[0].ate_rmse_m);
  EXPECT_EQ(report.segments[0].tracked_ratio, 1);
  EXPECT_THAT(report.segments[1].ate_rmse_m, Optional(DoubleNear(0, 1e-9)));
  const auto json = nlohmann::json::parse(FormatJsonReport({report}));
  EXPECT_EQ(json.at("sequences").at(0).at("directions_only_frames"), 40);
  EXPECT_THAT(FormatHtmlReport({{run, truth, {}, report}}),
              HasSubstr("40 frames were tracked in a map that had only infinite points"));
}

TEST(Evaluation, PureRotationHasARotationErrorButNoAte) {
  auto truth = Helix(50);
  RunRecord run = PerfectRun(truth);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    truth[i].truth_from_camera.translation.setZero();
    run.frames[i].camera_from_map.translation.setZero();
  }
  const SequenceReport report = EvaluateRun(run, truth, {});
  EXPECT_FALSE(report.ate_rmse_m);
  EXPECT_FALSE(report.scale);
  EXPECT_THAT(report.rotation_rmse_deg, Optional(DoubleNear(0, 1e-5)));
}

TEST(Evaluation, UsesOnlyGroundTruthThatIsCloseInTime) {
  const auto truth = Helix(50);
  RunRecord run = PerfectRun(truth);
  for (FrameRecord& frame : run.frames) frame.time += std::chrono::seconds(100);
  EXPECT_FALSE(EvaluateRun(run, truth, {}).rotation_rmse_deg);
}

TEST(Evaluation, HasNoErrorsWhereTheTruthCoversAFewFramesOnlyAndSaysSo) {
  const auto truth = Helix(400);
  RunRecord run = PerfectRun(truth);
  for (std::size_t i = 0; i < run.frames.size(); ++i)
    MoveInTruth(&run.frames[i], {0, i % 2 == 0 ? 0.5 : -0.5, 0});
  const auto with = [&](std::ptrdiff_t poses) {
    return EvaluateRun(run, {truth.begin(), truth.begin() + poses}, {{TimeOf(0), "walk"}});
  };
  const SequenceReport few = with(9);
  EXPECT_EQ(few.compared_frames, 9);
  EXPECT_EQ(few.maps.at(0).compared_frames, 9);
  EXPECT_FALSE(few.ate_rmse_m);
  EXPECT_FALSE(few.scale);
  EXPECT_FALSE(few.rotation_rmse_deg);
  EXPECT_FALSE(few.segments.at(0).ate_rmse_m);
  EXPECT_FALSE(MakeRunRow({}, run, few, std::nullopt).ate_m);
  EXPECT_THAT(FormatSummary(few), HasSubstr("only 9 of 400 tracked frames have a true pose"));
  const auto json = nlohmann::json::parse(FormatJsonReport({few}));
  EXPECT_EQ(json.at("sequences").at(0).at("compared_frames"), 9);
  EXPECT_THAT(FormatHtmlReport({{run, truth, {}, few}}), HasSubstr("9 frames"));

  const SequenceReport part = with(60);
  EXPECT_TRUE(part.ate_rmse_m);
  EXPECT_THAT(FormatSummary(part), HasSubstr("only 60 of 400 tracked frames"));
  EXPECT_THAT(FormatSummary(with(400)), Not(HasSubstr("true pose")));
  EXPECT_EQ(CoverageWarning(5, 5), "") << "the truth covers all of a short run";
  EXPECT_EQ(CoverageWarning(0, 0), "");
  EXPECT_THAT(FormatSummary(EvaluateRun(run, {}, {})), Not(HasSubstr("true pose")));

  // The clocks of the camera and of the ground truth differ.
  for (FrameRecord& frame : run.frames) frame.time += std::chrono::seconds(100);
  EXPECT_THAT(FormatSummary(with(400)), HasSubstr("only 0 of 400 tracked frames have a true pose"));
}

TEST(Evaluation, LeavesOutThePositionsOfAMapWithAFewFramesOnly) {
  const auto truth = Helix(109);
  RunRecord run = PerfectRun(truth);
  for (std::size_t i = 0; i < 100; ++i) MoveInTruth(&run.frames[i], {0, i % 2 == 0 ? 0.1 : -0.1, 0});
  for (std::size_t i = 100; i < 109; ++i) run.frames[i].map_key = 2;
  const SequenceReport report = EvaluateRun(run, truth, {{TimeOf(0), "walk"}, {TimeOf(100), "short"}});
  EXPECT_EQ(report.maps.at(1).compared_frames, 9);
  EXPECT_TRUE(report.frame_results[99].position_error_m);
  EXPECT_FALSE(report.frame_results[100].position_error_m);
  EXPECT_FALSE(report.frame_results[100].position_in_truth);
  EXPECT_TRUE(report.frame_results[100].rotation_error_deg);
  EXPECT_TRUE(report.segments.at(0).ate_rmse_m);
  EXPECT_FALSE(report.segments.at(1).ate_rmse_m);
  ASSERT_TRUE(report.ate_rmse_m);
  EXPECT_THAT(MakeRunRow({}, run, report, std::nullopt).ate_m,
              Optional(DoubleNear(*report.ate_rmse_m, 1e-9)));
}

TEST(Evaluation, IsEmptyForAnEmptyRun) {
  const SequenceReport report = EvaluateRun({}, {}, {});
  EXPECT_EQ(report.tracked_ratio, 0);
  EXPECT_FALSE(report.first_tracked_frame);
  EXPECT_THAT(FormatSummary(report), HasSubstr("never tracked"));
}

TEST(Quantiles, AreNearestRanks) {
  EXPECT_EQ(Quantile({}, 0.5), 0);
  EXPECT_EQ(Quantile({3, 1, 2}, 0.5), 2);
  std::vector<double> values;
  for (int i = 1; i <= 100; ++i) values.push_back(i);
  EXPECT_EQ(Quantile(values, 0.95), 95);
  EXPECT_EQ(Quantile(values, 1), 100);
}

TEST(JsonReport, HasEveryFieldAndNullForUnknownValues) {
  SequenceReport report;
  report.name = "a \"b\" \xff";
  const auto json = nlohmann::json::parse(FormatJsonReport({report}));
  const auto& sequence = json.at("sequences").at(0);
  for (const char* field : {"name", "frames", "tracked", "tracked_ratio", "first_tracked_frame",
                            "last_tracked_frame", "relocalizations", "ate_rmse_m", "rotation_rmse_deg",
                            "rotation_drift_deg", "turn_error_deg", "scale", "wall_s", "peak_memory_mb"}) {
    EXPECT_TRUE(sequence.contains(field)) << field;
  }
  EXPECT_TRUE(sequence.at("ate_rmse_m").is_null());
  for (const char* field : {"sixdof", "panorama", "localized"})
    EXPECT_EQ(sequence.at("keyframes").at(field), 0);
  for (const char* field : {"finite", "infinite", "converted"}) EXPECT_EQ(sequence.at("points").at(field), 0);
  for (const char* field : {"median", "p95", "max"}) EXPECT_EQ(sequence.at("tracking_ms").at(field), 0);
  for (const char* field :
       {"bundle_adjustment", "panorama_localization", "infinite_triangulation", "other"}) {
    EXPECT_EQ(sequence.at("mapping_s").at(field), 0);
  }
}

TEST(HtmlReport, IsSelfContainedAndEscapesNames) {
  EvaluatedRun evaluated;
  evaluated.truth = Helix(300);
  evaluated.run = PerfectRun(evaluated.truth);
  evaluated.run.name = "<script>alert(1)</script>";
  evaluated.run.maps = {{1, "Desk & \"3\"", false, {}, {}, {}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}}}};
  evaluated.report = EvaluateRun(evaluated.run, evaluated.truth, {});
  const std::string html = FormatHtmlReport({evaluated});
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("src=")));
  EXPECT_THAT(html, Not(HasSubstr("href=")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, HasSubstr("Desk &amp; &quot;3&quot;"));
  for (const char* title : {"Tracking by state", "Keyframes", "Points", "Tracking time", "from above",
                            "Position error", "Rotation error"}) {
    EXPECT_THAT(html, HasSubstr(title));
  }
}

TEST(GroundTruth, NamesTheLineOfAnError) {
  const auto error = [](const std::string& text) {
    return ErrorOf([&] { ParseGroundTruth(text, "truth"); });
  };
  EXPECT_EQ(ParseGroundTruth("# head\n1.5 1 2 3 0 0 0 1\n", "truth").at(0).time,
            std::chrono::milliseconds(1500));
  EXPECT_THAT(error("1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0\n"), HasSubstr("truth, line 2"));
  EXPECT_THAT(error("1 1 2 3 0 0 0 2\n"), HasSubstr("quaternion"));
  EXPECT_THAT(error("1 1 2 nan 0 0 0 1\n"), HasSubstr("finite"));
  EXPECT_THAT(error("2 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n"), HasSubstr("line 2"));
  EXPECT_THAT(error("# nothing\n"), HasSubstr("no poses"));
}

TEST(GroundTruth, RefusesTimesThatAreCenturiesAway) {
  for (const char* text : {"-8000000000", "-3000000001", "3000000001"}) {
    const std::string time = text;
    EXPECT_THAT(ErrorOf([&] { ParseGroundTruth(time + " 1 2 3 0 0 0 1\n", "truth"); }),
                AllOf(HasSubstr("truth, line 1"), HasSubstr("95 years")));
    EXPECT_THAT(ErrorOf([&] { ParseSegments(time + " walk\n", "segments"); }),
                AllOf(HasSubstr("segments, line 1"), HasSubstr("95 years")));
  }
  EXPECT_EQ(ParseGroundTruth("-3000000000 1 2 3 0 0 0 1\n3000000000 1 2 3 0 0 0 1\n", "truth").size(), 2u);
}

TEST(GroundTruth, FindsThePoseNearestInTime) {
  const auto truth = Helix(3);
  EXPECT_EQ(FindPose(truth, TimeOf(1) + std::chrono::milliseconds(9), std::chrono::milliseconds(10)),
            &truth[1]);
  EXPECT_EQ(FindPose(truth, TimeOf(2) - std::chrono::milliseconds(9), std::chrono::milliseconds(10)),
            &truth[2]);
  EXPECT_EQ(FindPose(truth, TimeOf(1) + std::chrono::milliseconds(16), std::chrono::milliseconds(10)),
            nullptr);
  EXPECT_EQ(FindPose(truth, TimeOf(9), std::chrono::milliseconds(10)), nullptr);
}

TEST(GroundTruth, InterpolatesBetweenPoses) {
  std::vector<TimedPose> truth = {{Timestamp(0), {engine::Rotation3(), {1, 2, 3}}},
                                  {Timestamp(40'000'000), {engine::Rotation3::Exp({0, 0.4, 0}), {2, 2, 5}}}};
  const Timestamp quarter = truth[1].time / 4, far = std::chrono::seconds(1);
  const auto pose = InterpolatePose(truth, quarter, far);
  ASSERT_TRUE(pose);
  EXPECT_TRUE(engine::IsNear(*pose, {engine::Rotation3::Exp({0, 0.1, 0}), {1.25, 2, 3.5}}, 1e-9, 1e-9));
  EXPECT_TRUE(
      engine::IsNear(*InterpolatePose(truth, truth[1].time, far), truth[1].truth_from_camera, 1e-9, 1e-9));
  EXPECT_TRUE(
      engine::IsNear(*InterpolatePose(truth, TimeOf(2), far), truth[1].truth_from_camera, 1e-9, 1e-9));
  // If one neighbour is too far away in time, the other is used; if both are, there is no pose.
  EXPECT_TRUE(
      engine::IsNear(*InterpolatePose(truth, quarter, quarter), truth[0].truth_from_camera, 1e-9, 1e-9));
  EXPECT_FALSE(InterpolatePose(truth, quarter, quarter / 2));
}

}  // namespace
}  // namespace docent::app
