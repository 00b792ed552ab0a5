// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/options.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"
#include "engine/mapping/calibration/self_calibration.h"
#include "tests/support/error_of.h"

namespace docent::app {
namespace {

// Parses a command line with one subcommand, as the program does; returns its options, or nothing on an
// error.
template <typename Options>
std::optional<Options> Parse(void (*add)(CLI::App*, Invocation*,
                                         std::function<void(const Options&, Verbosity)>),
                             const std::string& words) {
  CLI::App program("test", "docent");
  program.require_subcommand(1);
  Invocation invocation;
  auto parsed = std::make_shared<std::optional<Options>>();
  add(&program, &invocation, [parsed](const Options& options, Verbosity) { *parsed = options; });
  try {
    program.parse(words, false);
  } catch (const CLI::ParseError&) {
    return std::nullopt;
  }
  invocation.run();
  return *parsed;
}

TEST(AuthorOptions, AcceptEveryDocumentedOption) {
  const auto options = Parse<AuthorOptions>(
      AddAuthorCommand,
      "author --library museum.docent --camera left --camera right --calibration l.yaml --calibration r.yaml "
      "--camera-format 640x480@30 --pace lockstep --engine hybrid --headless --output out --record view.mp4 "
      "--seed 42 --script in.txt --record-script out.txt --from 1.5 --until 20");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->library, "museum.docent");
  EXPECT_EQ(options->run.cameras.sources, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(options->run.cameras.calibrations, (std::vector<std::filesystem::path>{"l.yaml", "r.yaml"}));
  EXPECT_EQ(options->run.cameras.options.device_format.width_px, 640);
  EXPECT_EQ(options->run.cameras.from, std::chrono::milliseconds(1500));
  EXPECT_EQ(options->run.cameras.until, std::chrono::seconds(20));
  EXPECT_EQ(options->run.pace, Pace::kLockstep);
  EXPECT_EQ(options->run.engine, EngineKind::kHybrid);
  EXPECT_TRUE(options->run.headless);
  EXPECT_EQ(options->run.output, "out");
  EXPECT_EQ(options->run.record, "view.mp4");
  EXPECT_EQ(options->run.seed, 42u);
  EXPECT_EQ(options->script, "in.txt");
  EXPECT_EQ(options->record_script, "out.txt");
}

TEST(AuthorOptions, RejectInvalidValues) {
  const auto rejected = [](const std::string& words) {
    return !Parse<AuthorOptions>(AddAuthorCommand, "author --library l --camera c" + words);
  };
  EXPECT_FALSE(rejected(""));
  EXPECT_TRUE(rejected(" --camera d --camera e"));
  EXPECT_TRUE(rejected(" --calibration a --calibration b"));
  EXPECT_TRUE(rejected(" --pace slow"));
  EXPECT_TRUE(rejected(" --engine fast"));
  EXPECT_TRUE(rejected(" --camera-format big"));
  EXPECT_TRUE(rejected(" --seed -1"));
  EXPECT_TRUE(rejected(" --from -1"));
  EXPECT_TRUE(rejected(" --from 5 --until 4"));
  EXPECT_TRUE(rejected(" --target a.png --target-width 1e300"));
  EXPECT_TRUE(rejected(" --target a.png --target-width 0"));
  EXPECT_TRUE(rejected(" --camera d --baseline 1e300"));
  EXPECT_TRUE(rejected(" --camera d --baseline -1"));
  EXPECT_TRUE(rejected(" stray"));
  EXPECT_FALSE(Parse<AuthorOptions>(AddAuthorCommand, "author --library l"));
  EXPECT_FALSE(Parse<AuthorOptions>(AddAuthorCommand, "author --camera c"));
}

TEST(TourOptions, RequireALibraryAndACamera) {
  const auto options = Parse<TourOptions>(AddTourCommand, "tour --library l --camera sim:museum");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->run.cameras.sources.front(), "sim:museum");
  EXPECT_EQ(options->run.seed, 1u);
  EXPECT_FALSE(Parse<TourOptions>(AddTourCommand, "tour --library l"));
}

TEST(EvaluateOptions, AcceptSeveralSequencesInAnyOrder) {
  const auto options = Parse<EvaluateOptions>(
      AddEvaluateCommand,
      "evaluate --calibration a.yaml kitchen --output out room --pace lockstep --engine sixdof");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->sequences, (std::vector<std::string>{"kitchen", "room"}));
  EXPECT_EQ(options->calibrations, (std::vector<std::filesystem::path>{"a.yaml"}));
  EXPECT_EQ(options->pace, Pace::kLockstep);
  EXPECT_EQ(Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate a --output b")->pace, Pace::kEager);
  EXPECT_TRUE(options->dump_frames.empty());
  EXPECT_FALSE(Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate --output out"));
  EXPECT_FALSE(Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate kitchen"));
}

TEST(EvaluateOptions, AcceptSeveralFramesToDump) {
  const auto options = Parse<EvaluateOptions>(
      AddEvaluateCommand, "evaluate --dump-frame 0 kitchen --output out --dump-frame 412");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->sequences, (std::vector<std::string>{"kitchen"}));
  EXPECT_EQ(options->dump_frames, (std::vector<std::size_t>{0, 412}));
  EXPECT_FALSE(Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate kitchen --output out --dump-frame -1"));
  EXPECT_FALSE(Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate kitchen --output out --dump-frame last"));
}

TEST(EvaluateOptions, AcceptSeedsStartsWindowAndJobs) {
  const auto options = Parse<EvaluateOptions>(
      AddEvaluateCommand,
      "evaluate kitchen --output out --pace lockstep --seed 7 --seeds 20 --starts 10 --window 2.5 --jobs 2");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->seed, 7u);
  EXPECT_EQ(options->seeds, 20u);
  EXPECT_EQ(options->starts, 10u);
  EXPECT_EQ(options->window, std::chrono::milliseconds(2500));
  EXPECT_EQ(options->jobs, 2u);
  EXPECT_TRUE(options->many_runs());
  const auto one = Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate kitchen --output out --window 3");
  ASSERT_TRUE(one);
  EXPECT_FALSE(one->many_runs());
}

TEST(EvaluateOptions, RejectInvalidCounts) {
  const auto rejected = [](const std::string& words) {
    return !Parse<EvaluateOptions>(AddEvaluateCommand, "evaluate kitchen --output out" + words);
  };
  EXPECT_FALSE(rejected(" --seeds 1000"));
  for (const char* words :
       {" --seeds 0", " --seeds -1", " --seeds 1001", " --seeds two", " --seeds 1.5", " --starts 0",
        " --starts -3", " --window -1", " --window nan", " --pace lockstep --jobs 0"}) {
    EXPECT_TRUE(rejected(words)) << words;
  }
  EXPECT_TRUE(rejected(" --jobs 2")) << "the pace is not lockstep";
  EXPECT_TRUE(rejected(" --seeds 2 --dump-frame 3"));
}

TEST(CalibrateOptions, RefuseToReplaceWhatIsRead) {
  const auto accepted = [](const std::string& words) {
    return Parse<CalibrateOptions>(AddCalibrateCommand, "calibrate " + words).has_value();
  };
  EXPECT_TRUE(accepted("--camera walk.mp4 --output camera.yaml --print board.pdf"));
  EXPECT_FALSE(accepted("--camera walk.mp4 --output walk.mp4"));
  EXPECT_FALSE(accepted("--camera walk.mp4 --output ./walk.mp4"));
  EXPECT_FALSE(accepted("--camera walk.mp4 --output camera.yaml --print walk.mp4"));
  EXPECT_FALSE(accepted("--camera walk.mp4 --output board.pdf --print board.pdf"));
}

TEST(AuthorOptions, RefuseToReplaceWhatIsRead) {
  const auto accepted = [](const std::string& words) {
    return Parse<AuthorOptions>(
               AddAuthorCommand,
               "author --library m.docent --camera c --calibration c.yaml --script s.txt --target t.png "
               "--target-width 1 " +
                   words)
        .has_value();
  };
  EXPECT_TRUE(accepted("--record view.mp4 --record-script new.txt"));
  for (const char* read : {"m.docent", "./m.docent", "c", "c.yaml", "s.txt", "t.png"}) {
    EXPECT_FALSE(accepted("--record-script " + std::string(read))) << read;
    EXPECT_FALSE(accepted("--record " + std::string(read))) << read;
  }
  EXPECT_FALSE(accepted("--record new.txt --record-script new.txt"));
}

TEST(AuthorOptions, RefuseACameraWhoseImagesNoLibraryCanStore) {
  const auto error = [](int width, int height) {
    const engine::CameraModel camera = engine::LensWithFieldOfView(width, height, 60);
    return ErrorOf([&] { CheckStorableSize(camera, "'desk'"); });
  };
  EXPECT_EQ(error(64, 64), "");
  EXPECT_EQ(error(8192, 8192), "");
  EXPECT_EQ(error(16384, 4096), "");
  EXPECT_THAT(error(640, 63), testing::AllOf(testing::HasSubstr("'desk'"), testing::HasSubstr("640x63")));
  EXPECT_THAT(error(16385, 480), testing::HasSubstr("16385x480"));
  EXPECT_THAT(error(16384, 8192), testing::HasSubstr("16384x8192"));
}

TEST(TourOptions, RefuseAKioskWithoutAWindow) {
  EXPECT_TRUE(Parse<TourOptions>(AddTourCommand, "tour --library l --camera c --kiosk code"));
  EXPECT_FALSE(Parse<TourOptions>(AddTourCommand, "tour --library l --camera c --kiosk code --headless"));
  EXPECT_FALSE(Parse<TourOptions>(AddTourCommand, "tour --library l --camera c --record l"));
}

TEST(DemoOptions, RequireAnOutputFolderWhenHeadless) {
  EXPECT_TRUE(Parse<DemoOptions>(AddDemoCommand, "demo"));
  EXPECT_FALSE(Parse<DemoOptions>(AddDemoCommand, "demo --headless"));
  EXPECT_EQ(Parse<DemoOptions>(AddDemoCommand, "demo --headless --output out")->output, "out");
}

TEST(Pace, IsRealtimeForDevicesAndWindowsAndEagerForHeadlessFiles) {
  RunArguments run;
  EXPECT_EQ(ResolvePace(run, false), Pace::kRealtime);
  run.headless = true;
  EXPECT_EQ(ResolvePace(run, false), Pace::kEager);
  EXPECT_EQ(ResolvePace(run, true), Pace::kRealtime);
  run.pace = Pace::kLockstep;
  EXPECT_EQ(ResolvePace(run, true), Pace::kLockstep);
}

}  // namespace
}  // namespace docent::app
