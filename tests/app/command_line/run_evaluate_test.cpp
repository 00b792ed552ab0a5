// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "app/command_line/evaluate_sequence.h"
#include "app/command_line/runs.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr char kShortSequence[] = "sim:cylinder:20,duration=0.3";

// A recording of two numbered images in the folder `name`.
std::filesystem::path WriteRecording(const TemporaryFolder& folder, const std::string& name) {
  const std::filesystem::path recording = folder / name;
  std::filesystem::create_directories(recording);
  for (const char* image : {"1.png", "2.png"})
    EXPECT_TRUE(cv::imwrite((recording / image).string(), cv::Mat(48, 64, CV_8UC1, cv::Scalar(90))));
  return recording;
}

std::size_t CountFiles(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::recursive_directory_iterator(folder), {}));
}

TEST(RunEvaluate, WritesNothingIntoARecordingThatItReads) {
  const TemporaryFolder folder;
  const std::filesystem::path recording = WriteRecording(folder, "data/walk");
  EvaluateOptions options;
  options.pace = Pace::kLockstep;
  options.sequences = {recording.string()};
  std::filesystem::create_directory_symlink(folder / "data", folder / "link");
  for (const std::filesystem::path& output :
       {folder / "data", folder / "link", recording, recording / "report"}) {
    options.output = output;
    EXPECT_THAT(ErrorOf([&] { RunEvaluate(options, Verbosity::kQuiet); }),
                AllOf(HasSubstr("would be written into the recording"), HasSubstr(recording.string())))
        << output;
  }
  EXPECT_EQ(CountFiles(folder / "data"), 3u);
}

TEST(RunEvaluate, WritesNothingIntoAnotherRecordingOfTheSameCommand) {
  const TemporaryFolder folder;
  EvaluateOptions options;
  options.sequences = {WriteRecording(folder, "walk").string(),
                       WriteRecording(folder, "report/walk").string()};
  options.output = folder / "report";
  EXPECT_THAT(ErrorOf([&] { RunEvaluate(options, Verbosity::kQuiet); }),
              HasSubstr("would be written into the recording"));
  EXPECT_EQ(CountFiles(folder / "report"), 3u);
}

TEST(RunEvaluate, ReportsFinishedRunsAfterAFailureOfTheFileSystem) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "broken");
  std::filesystem::create_symlink("rgb.txt", folder / "broken/rgb.txt");
  EvaluateOptions options;
  options.pace = Pace::kLockstep;
  options.sequences = {kShortSequence, (folder / "broken").string()};
  options.output = folder / "report";
  EXPECT_THROW(RunEvaluate(options, Verbosity::kQuiet), std::exception);
  const auto report = nlohmann::json::parse(ReadAll(folder / "report/report.json"));
  EXPECT_EQ(report.at("sequences").size(), 1u);
  EXPECT_TRUE(std::filesystem::exists(folder / "report/report.html"));
}

TEST(RunEvaluate, ReportsTheFinishedRunsOfManyWhenOneFails) {
  const TemporaryFolder folder;
  EvaluateOptions options;
  options.pace = Pace::kLockstep;
  options.sequences = {kShortSequence};
  options.seeds = 3;
  options.output = folder / "report";
  std::string name = DescribeSequence(options, 0).name;
  std::replace(name.begin(), name.end(), ':', '-');
  folder.Write("report/" + name + "/seed-2-start-0", "a file where the folder of the run would be");
  EXPECT_THAT(ErrorOf([&] { RunEvaluate(options, Verbosity::kQuiet); }), HasSubstr("seed-2-start-0"));
  const auto report = nlohmann::json::parse(ReadAll(folder / "report/report.json"));
  const auto& runs = report.at("sequences").at(0).at("distribution").at("runs");
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs.at(0).at("seed"), 1);
  EXPECT_TRUE(std::filesystem::exists(folder / "report/report.html"));
}

}  // namespace
}  // namespace docent::app
