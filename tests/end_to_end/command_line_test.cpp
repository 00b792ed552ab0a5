// SPDX-License-Identifier: Apache-2.0
// Tests of the real program's output, errors and exit status.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "app/calibration/calibration_file.h"
#include "app/command_line/program.h"
#include "app/command_line/text_table.h"
#include "app/evaluation/ground_truth.h"
#include "app/files/text_file.h"
#include "app/session/library_scene.h"
#include "maps/library/library.h"
#include "tests/app/support/board_camera.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::StartsWith;

// The subcommands that the help of a command lists, with their aliases.
std::vector<std::string> ListedSubcommands(const std::string& help) {
  std::istringstream lines(help);
  std::string line;
  while (std::getline(lines, line) && line != "Subcommands:") {
  }
  std::vector<std::string> names;
  while (std::getline(lines, line) && !line.empty()) {
    // A description goes on in lines that begin further to the right.
    if (line.starts_with("   ")) continue;
    std::istringstream words(line);
    std::string name;
    for (bool has_more = true; has_more && words >> name; names.push_back(name)) {
      has_more = name.ends_with(',');
      if (has_more) name.pop_back();
    }
  }
  return names;
}

TEST(CommandLine, HelpShowsAnExampleForEverySubcommand) {
  using Words = std::vector<std::string>;
  std::vector<Words> commands(1);  // The program itself.
  for (std::size_t i = 0; i < commands.size(); ++i) {
    Words command = commands[i];
    command.push_back("--help");
    const Outcome outcome = RunDocent(command);
    SCOPED_TRACE(testing::PrintToString(command));
    EXPECT_EQ(outcome.exit_status, 0);
    EXPECT_THAT(outcome.output, AllOf(HasSubstr("Usage:"), HasSubstr("Example:\n  docent")));
    EXPECT_THAT(outcome.errors, IsEmpty());
    for (const std::string& name : ListedSubcommands(outcome.output)) {
      command.back() = name;
      commands.push_back(command);
    }
  }
  EXPECT_THAT(commands, IsSupersetOf({Words{"demo"}, Words{"content", "import"}, Words{"hub", "user", "add"},
                                      Words{"maps", "tour", "remove"}}))
      << "the help lists subcommands in another way than this test reads them";
}

TEST(CommandLine, SaysThatATourEstimatesNoCalibration) {
  const auto help = [](const std::string& command) {
    std::string text;  // Without the line breaks, whose places depend on the width.
    for (const char c : RunDocent({command, "--help"}).output) {
      const char shown = c == '\n' ? ' ' : c;
      if (shown != ' ' || !text.ends_with(' ')) text += shown;
    }
    return text;
  };
  EXPECT_THAT(help("author"), HasSubstr("estimate the calibration while maps are built"));
  EXPECT_THAT(help("tour"), HasSubstr("a tour builds no map and estimates none"));
  EXPECT_THAT(help("tour"), Not(HasSubstr("while maps are built")));
}

TEST(CommandLine, HelpAndGuideHaveTheSameExitStatuses) {
  const std::string help = RunDocent({"--help"}).output;
  const std::string guide = ReadAll(DOCENT_SOURCE_DIR "/docs/guide.md");
  for (const auto& [status, meaning] : kExitStatusMeanings) {
    EXPECT_THAT(help, HasSubstr("\n  " + std::to_string(status) + "  " + meaning + "\n"));
    EXPECT_THAT(guide, HasSubstr("\n| " + std::to_string(status) + " | " + meaning + " |\n"));
  }
}

TEST(Messages, AreOneLineWithOneFullStop) {
  EXPECT_EQ(OneLine("An image operation failed:\n  it is empty..\n"),
            "An image operation failed: it is empty.");
  EXPECT_EQ(OneLine("There is no file 'a..b'."), "There is no file 'a..b'.");
  EXPECT_EQ(OneLine("wait..."), "wait...");
}

TEST(CommandLine, TheTitleOfAReportNamesItsFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "visits/old");
  const auto page = folder / "report.html";
  for (const char* name : {"visits", "visits/", "visits/.", "visits/old/.."}) {
    const Outcome outcome = RunDocent({"report", (folder / name).string(), "--output", page.string()});
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
    EXPECT_THAT(ReadAll(page), HasSubstr("Visits in visits<")) << name;
  }
}

TEST(CommandLine, AlignsTheListOfMapsWhateverTheirNames) {
  const TemporaryFolder folder;
  const auto file = folder / "l.docent";
  {
    maps::Library library = OpenLibrary(file, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name :
         {"Kueche", "Küche", "東京の部屋", "a name that is longer than the column was before"})
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  }
  std::istringstream lines(RunDocent({"maps", "list", "--library", file.string()}).output);
  std::set<std::size_t> columns;
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    columns.insert(DisplayWidth(line.substr(0, line.find(" open "))));
  EXPECT_EQ(count, 4);
  EXPECT_EQ(columns.size(), 1u) << "the policies are not in one column";
}

TEST(CommandLine, RefusesToStartBeyondTheEndOfARecording) {
  const TemporaryFolder folder;
  ExpectErrorLine({"author", "--library", (folder / "l.docent").string(), "--camera", "sim:room,duration=1",
                   "--from", "9", "--headless"},
                  1, "--from 9 is beyond the end of 'room,duration=1'");
  EXPECT_FALSE(std::filesystem::exists(folder / "l.docent"));
}

TEST(CommandLine, PrintsItsVersion) {
  const Outcome outcome = RunDocent({"--version"});
  EXPECT_EQ(outcome.exit_status, 0);
  EXPECT_THAT(outcome.output, StartsWith("docent "));
}

TEST(CommandLine, ReportsAWrongArgumentInOneLineWithExitStatusTwo) {
  ExpectErrorLine({}, 2, "subcommand");
  ExpectErrorLine({"dance"}, 2, "There is no subcommand 'dance' (see docent --help)");
  ExpectErrorLine({"maps"}, 2, "docent maps --help");
  ExpectErrorLine({"maps", "list"}, 2, "--library is required");
  ExpectErrorLine({"maps", "dance"}, 2, "There is no subcommand 'dance'");
  ExpectErrorLine({"maps", "list", "--libary", "x"}, 2, "There is no option '--libary'");
  ExpectErrorLine({"maps", "list", "stray", "--library", "x"}, 2, "Unexpected argument 'stray'");
  ExpectErrorLine({"maps", "policy", "Desk", "shut", "--library", "x"}, 2, "shut");
  ExpectErrorLine({"maps", "show", "--library", "x"}, 2, "NAME is required");
  ExpectErrorLine({"simulate", "room"}, 2, "--output is required");
  ExpectErrorLine({"simulate", "room", "--output", "x", "--fps", "-3"}, 2, "--fps");
  ExpectErrorLine({"simulate", "room", "--output", "x", "--seed", "many"}, 2, "many");
  ExpectErrorLine({"--quiet", "--verbose", "cameras"}, 2, "excludes");
}

TEST(CommandLine, ReportsAFailureInOneLineWithExitStatusOne) {
  const TemporaryFolder folder;
  ExpectErrorLine({"maps", "list", "--library", (folder / "none.docent").string()}, 1, "none.docent");
  const auto broken = folder.Write("broken.docent", "this is no database");
  ExpectErrorLine({"maps", "list", "--library", broken.string()}, 1, "broken.docent");
  ExpectErrorLine({"maps", "verify", "--library", broken.string()}, 1, "broken.docent");
  ExpectErrorLine({"content", "list", "--library", broken.string()}, 1, "broken.docent");
  EXPECT_EQ(ReadAll(broken), "this is no database");
  ExpectErrorLine({"simulate", "nowhere", "--output", (folder / "out").string()}, 1, "nowhere");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  ExpectErrorLine({"simulate", "room", "--output", (broken / "out").string()}, 1, "broken.docent");
}

TEST(CommandLine, ListsCamerasAsTextAndJson) {
  const Outcome text = RunDocent({"cameras"});
  EXPECT_EQ(text.exit_status, 0);
  EXPECT_THAT(text.output, Not(IsEmpty())) << "it says so if there are none";
  const Outcome outcome = RunDocent({"cameras", "--json"});
  EXPECT_EQ(outcome.exit_status, 0);
  EXPECT_TRUE(nlohmann::json::parse(outcome.output).at("cameras").is_array());
}

TEST(CommandLine, SimulatesASequenceThatCanBeReadBack) {
  const TemporaryFolder folder;
  const Outcome outcome = RunDocent(
      {"simulate", "cylinder:10", "--output", folder.path().string(), "--duration", "0.3", "--seed", "7"});
  ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
  EXPECT_THAT(outcome.errors, IsEmpty());
  const auto source = OpenCamera(folder.path().string());
  ASSERT_TRUE(source->info().calibration_path);
  const engine::CameraModel camera = ReadCalibration(*source->info().calibration_path);
  engine::Frame frame;
  std::uint64_t count = 0;
  for (; source->Next(&frame); ++count) CheckImageSize(camera, frame.image.cols, frame.image.rows, "a", "b");
  EXPECT_GE(count, 5u);
  EXPECT_EQ(ReadGroundTruth(*source->info().ground_truth_path).size(), count);

  const TemporaryFolder again;
  const Outcome quiet = RunDocent({"simulate", "cylinder:10", "--output", again.path().string(), "--duration",
                                   "0.3", "--seed", "7", "--quiet"});
  EXPECT_EQ(quiet.exit_status, 0);
  EXPECT_THAT(quiet.output + quiet.errors, IsEmpty());
  const std::string list = ReadAll(folder / "rgb.txt");
  EXPECT_EQ(list, ReadAll(again / "rgb.txt"));
  const std::size_t begin = list.find("rgb/");
  const std::string first = list.substr(begin, list.find('\n', begin) - begin);
  EXPECT_EQ(ReadAll(folder / first), ReadAll(again / first));
}

TEST(CommandLine, CalibratesACameraFromAFolderOfImages) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "images");
  const engine::CameraModel truth(engine::LensModel::kFov, {640, 480, 360, 361, 316.4, 244.9}, {0.92});
  const BoardSpec board = ParseBoard("charuco:8x6:30");
  const BoardCamera camera(board, truth);
  Random random(5);
  int count = 0;
  for (const engine::Rigid3& pose : BoardPoses(board, truth, 14)) {
    const std::string name = "images/view" + std::to_string(++count) + ".png";
    cv::imwrite((folder / name).string(), camera.Image(pose, &random));
  }
  const std::string images = (folder / "images").string(), output = (folder / "camera.yaml").string();
  const Outcome outcome =
      RunDocent({"calibrate", "--camera", images, "--board", "charuco:8x6:30", "--lens", "fov", "--headless",
                 "--output", output, "--print", (folder / "board.pdf").string()});
  ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output, AllOf(HasSubstr("board.pdf"), HasSubstr("14 images"), HasSubstr("Good")));
  const engine::CameraModel found = ReadCalibration(output);
  EXPECT_NEAR(found.intrinsics().fx / 360, 1, 0.002);
  EXPECT_NEAR(found.intrinsics().cx, 316.4, 0.5);
  EXPECT_THAT(ReadAll(output), HasSubstr("assessment: \"Good"));
  // Two images are too few; the existing calibration file must stay unchanged.
  for (int i = 3; i <= count; ++i)
    std::filesystem::remove(folder / ("images/view" + std::to_string(i) + ".png"));
  const std::string before = ReadAll(output);
  ExpectErrorLine({"calibrate", "--camera", images, "--headless", "--output", output}, 1, "only 2 images");
  EXPECT_EQ(ReadAll(output), before);
  EXPECT_FALSE(std::filesystem::exists(output + ".part"));
  // Whether the file can be written is known before the views are collected.
  for (const std::string& place : {(folder / "none/camera.yaml").string(), images})
    ExpectErrorLine({"calibrate", "--camera", images, "--headless", "--output", place},
                    images == place ? 2 : 1, place);
  ExpectErrorLine({"calibrate"}, 2, "--print");
  ExpectErrorLine({"calibrate", "--print", "x.pdf", "--board", "charuco:8"}, 2, "calibration board");
}

TEST(CommandLine, DoesNotRecordOverItsOwnImages) {
  const TemporaryFolder folder;
  const std::string walk = folder.Write("walk.mp4", std::string("images")).string();
  const std::string video = folder.Write("sequence/video.mp4", std::string("images")).string();
  const std::string library = (folder / "museum.docent").string();
  for (const std::string& record : {walk, (folder / "sequence/../walk.mp4").string(), video}) {
    ExpectErrorLine({"author", "--library", library, "--camera", walk, "--camera",
                     (folder / "sequence").string(), "--record", record, "--headless"},
                    2, "would overwrite the file of --camera");
  }
  EXPECT_EQ(ReadTextFile(walk), "images");
  EXPECT_EQ(ReadTextFile(video), "images");
}

TEST(CommandLine, SaysThatALibraryIsEmptyAndRefusesItsMaps) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  { maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes); }
  EXPECT_THAT(RunDocent({"maps", "list", "--library", path}).output, HasSubstr("no map"));
  const Outcome json = RunDocent({"maps", "list", "--library", path, "--json"});
  EXPECT_TRUE(nlohmann::json::parse(json.output).at("maps").empty());
  EXPECT_THAT(RunDocent({"maps", "verify", "--library", path}).output, HasSubstr("no problems found"));
  EXPECT_THAT(RunDocent({"content", "list", "--library", path}).output, HasSubstr("Nothing is placed"));
  ExpectErrorLine({"maps", "show", "Desk", "--library", path}, 1, "Desk");
  ExpectErrorLine({"maps", "rename", "Desk", "Kiosk", "--library", path}, 1, "Desk");
  ExpectErrorLine({"maps", "remove", "Desk", "--library", path}, 1, "Desk");
  ExpectErrorLine({"maps", "policy", "Desk", "read-only", "--library", path}, 1, "Desk");
  ExpectErrorLine({"content", "remove", "sign-1", "--map", "Desk", "--library", path}, 1, "Desk");
}

}  // namespace
}  // namespace docent::app
