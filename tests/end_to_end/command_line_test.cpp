// SPDX-License-Identifier: Apache-2.0
// Tests of the real program's output, errors and exit status.
#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "app/calibration/calibration_file.h"
#include "app/cameras/frame_source.h"
#include "app/command_line/program.h"
#include "app/command_line/text_table.h"
#include "app/demo/exhibit_model.h"
#include "app/evaluation/ground_truth.h"
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
using ::testing::Not;
using ::testing::StartsWith;

TEST(CommandLine, HelpShowsAnExampleForEverySubcommand) {
  const Outcome top = RunDocent({"--help"});
  EXPECT_EQ(top.exit_status, 0);
  EXPECT_THAT(top.errors, IsEmpty());
  const std::vector<std::vector<std::string>> commands = {
      {},
      {"demo"},
      {"author"},
      {"tour"},
      {"evaluate"},
      {"calibrate"},
      {"cameras"},
      {"simulate"},
      {"train-vocabulary"},
      {"maps"},
      {"maps", "list"},
      {"maps", "show"},
      {"maps", "verify"},
      {"maps", "rename"},
      {"maps", "remove"},
      {"maps", "policy"},
      {"maps", "export"},
      {"maps", "import"},
      {"maps", "optimize"},
      {"maps", "densify"},
      {"maps", "join"},
      {"maps", "recover"},
      {"maps", "tour"},
      {"maps", "tour", "list"},
      {"maps", "tour", "show"},
      {"maps", "tour", "create"},
      {"maps", "tour", "edit"},
      {"maps", "tour", "rename"},
      {"maps", "tour", "remove"},
      {"maps", "push"},
      {"maps", "pull"},
      {"hub"},
      {"hub", "init"},
      {"hub", "status"},
      {"hub", "revert"},
      {"hub", "backup"},
      {"hub", "restore"},
      {"hub", "hand-in"},
      {"hub", "collect"},
      {"hub", "user"},
      {"hub", "user", "add"},
      {"hub", "user", "remove"},
      {"hub", "user", "list"},
      {"content"},
      {"content", "list"},
      {"content", "add"},
      {"content", "import"},
      {"content", "edit"},
      {"content", "remove"},
  };
  for (std::vector<std::string> command : commands) {
    if (command.size() == 1) {
      EXPECT_THAT(top.output, HasSubstr("\n  " + command[0] + " "));
    }
    command.push_back("--help");
    const Outcome outcome = RunDocent(command);
    EXPECT_EQ(outcome.exit_status, 0) << testing::PrintToString(command);
    EXPECT_THAT(outcome.output, AllOf(HasSubstr("Usage:"), HasSubstr("Example:\n  docent")));
    EXPECT_THAT(outcome.errors, IsEmpty());
  }
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
  EXPECT_EQ(RunDocent({"cameras"}).exit_status, 0);
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
  ExpectErrorLine({"calibrate"}, 2, "--print");
  ExpectErrorLine({"calibrate", "--print", "x.pdf", "--board", "charuco:8"}, 2, "calibration board");
}

TEST(CommandLine, HandlesAnEmptyLibrary) {
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

TEST(CommandLine, EditsTheContentOfASavedMap) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  const std::string model = folder.Write("exhibit.glb", {glb.begin(), glb.end()}).string();
  std::uint64_t kiosk = 0;
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Desk", "Kiosk"}) {
      kiosk = library.NewKey();
      library.Save({kiosk, name, maps::Policy::kOpen, nullptr, nullptr});
    }
  }
  const auto run = [&](const std::string& verb, std::vector<std::string> more) {
    more.insert(more.begin(), {"content", verb, "--library", path, "--map", "Desk"});
    return more;
  };
  ASSERT_EQ(RunDocent(run("add", {model, "--at", "1", "2", "3"})).exit_status, 0);
  ASSERT_EQ(RunDocent(run("add", {"--signpost", "x", "--at", "0", "0", "2"})).exit_status, 0);
  const auto edited = [&](const std::vector<std::string>& more) {
    const Outcome outcome = RunDocent(run("edit", more));
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
    const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    AssetCache assets;
    return SceneFromRecord(library.LoadScene(library.FindByName("Desk").key), "Desk", &assets);
  };
  content::Scene scene =
      edited({"exhibit", "--move", "-1", "0.5", "0", "--scale", "2", "--rotate", "180", "--lock"});
  const engine::Sim3 pose = scene.Find("exhibit")->model.map_from_model;
  EXPECT_LT((pose.translation - Eigen::Vector3d(0, 2.5, 3)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(pose.scale, 2);
  // At yaw 0 the front faces -z; half a turn makes it +z.
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_TRUE(scene.Find("exhibit")->locked);
  ExpectErrorLine(run("edit", {"exhibit", "--hide"}), 1, "'exhibit' is locked; unlock it to change it.");
  EXPECT_THAT(RunDocent({"content", "list", "--library", path}).output, HasSubstr("(locked)"));

  scene = edited({"exhibit", "sign-1", "--duplicate"});
  EXPECT_EQ(scene.entities.size(), 4u);
  scene = edited({"exhibit", "exhibit-2", "--unlock", "--group", "pair", "--hide"});
  EXPECT_TRUE(scene.Find("exhibit-2")->hidden);
  EXPECT_EQ(scene.Find("exhibit")->group, "pair");
  scene = edited({"exhibit", "exhibit-2", "--ungroup", "--show"});
  EXPECT_FALSE(scene.Find("exhibit-2")->hidden);
  EXPECT_EQ(scene.Find("exhibit")->group, "");
  scene = edited({"sign-1", "--text", "To the kiosk", "--to", "Kiosk", "--rename", "kiosk sign"});
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.text, "To the kiosk");
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.to_key, kiosk);
  const auto listed = [&] { return RunDocent({"content", "list", "--library", path}).output; };
  EXPECT_THAT(listed(), HasSubstr("To the kiosk  (no direction)\n"));
  scene = edited({"kiosk sign", "--direction", "0", "-3", "4"});
  EXPECT_THAT(listed(), HasSubstr("To the kiosk\n"));
  EXPECT_LT((scene.Find("kiosk sign")->signpost.direction.value() - Eigen::Vector3d(0, -0.6, 0.8)).norm(),
            1e-12);
  ExpectErrorLine(run("edit", {"kiosk sign", "--find-direction"}), 1,
                  "where 'Kiosk' begins is not known from here");
  scene = edited({"kiosk sign", "--no-direction"});
  EXPECT_FALSE(scene.Find("kiosk sign")->signpost.direction);
  scene = edited({"kiosk sign", "--direction", "1", "0", "0", "--lock"});
  scene = edited(
      {"kiosk sign", "--to-nowhere", "--unlock", "--transform", "1", "2", "3", "0", "0", "0", "1", "0.5"});
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.to_map, "");
  EXPECT_FALSE(scene.Find("kiosk sign")->signpost.direction) << "it led to the kiosk";
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.anchor, Eigen::Vector3d(1, 2, 3));
  scene = edited({"exhibit", "--align", "0 0 0 to 5 0 0, 1 0 0 to 8 0 0, 0 1 0 to 5 3 0"});
  EXPECT_NEAR(scene.Find("exhibit")->model.map_from_model.scale, 3, 1e-9);
  EXPECT_LT((content::PlaceOf(*scene.Find("exhibit")) - Eigen::Vector3d(5, 0, 0)).norm(), 1e-9);
  const std::string corners = "0 0 0 to 5 0 0, 1 0 0 to 8 0 1, 0 1 0 to 5 3 0, 0 0 1 to 5 0 3";
  EXPECT_NE(edited({"exhibit", "--bend", corners}).Find("exhibit")->model.warp, nullptr);
  EXPECT_EQ(edited({"exhibit", "--unbend"}).Find("exhibit")->model.warp, nullptr);

  const std::string before = RunDocent({"content", "list", "--json", "--library", path}).output;
  ExpectErrorLine(run("edit", {"exhibit"}), 1, "No change is given");
  ExpectErrorLine(run("edit", {"fox", "--hide"}), 1, "no 'fox'");
  ExpectErrorLine(run("edit", {"exhibit", "--text", "x"}), 1, "is a model");
  ExpectErrorLine(run("edit", {"exhibit", "exhibit-2", "--rename", "x"}), 1, "not several");
  ExpectErrorLine(run("edit", {"kiosk sign", "--to", "Desk"}), 1, "its own map");
  ExpectErrorLine(run("edit", {"kiosk sign", "--to", "Attic"}), 1, "Attic");
  ExpectErrorLine(run("edit", {"kiosk sign", "--direction", "0", "0", "0"}), 1, "the direction is too short");
  ExpectErrorLine(run("edit", {"kiosk sign", "--find-direction"}), 1, "'kiosk sign' leads to no map");
  ExpectErrorLine(run("edit", {"exhibit", "--direction", "0", "0", "1"}), 1, "a model, which has no arrow");
  ExpectErrorLine(run("edit", {"kiosk sign", "--direction", "0", "0", "1", "--no-direction"}), 2,
                  "--no-direction");
  ExpectErrorLine(run("edit", {"exhibit", "--scale", "0"}), 2, "--scale");
  ExpectErrorLine(run("edit", {"exhibit", "--align", "0 0 0 to 1 1 1"}), 1, "at least 3 points");
  ExpectErrorLine(run("edit", {"exhibit", "--align", "0 0 0 to pixel 1 1, 1 0 0 to 1 0 0, 0 1 0 to 1 1 0"}),
                  1, "no image");
  ExpectErrorLine(run("edit", {"exhibit", "--bend", corners + "\n0 map stop"}), 1, "--bend");
  // What cannot be carried out as a whole changes nothing.
  ExpectErrorLine(run("edit", {"exhibit", "--move", "1", "0", "0", "--unbend"}), 1, "is not bent");
  ExpectErrorLine(run("edit", {"exhibit", "--move", "1", "0", "0", "--rename", "exhibit-2"}), 1, "already");
  EXPECT_EQ(RunDocent({"content", "list", "--json", "--library", path}).output, before);
}

TEST(CommandLine, KeepsChangesOfSavedContentUndoable) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  const std::string model = folder.Write("exhibit.glb", {glb.begin(), glb.end()}).string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Desk", maps::Policy::kOpen, nullptr, nullptr});
  }
  const auto run = [&](const std::string& verb, std::vector<std::string> more) {
    more.insert(more.begin(), {"content", verb, "--library", path, "--map", "Desk"});
    const Outcome outcome = RunDocent(more);
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
  };
  run("add", {model, "--at", "1", "2", "3"});
  run("edit", {"exhibit", "--move", "1", "0", "0", "--scale", "2"});
  run("remove", {"exhibit"});

  const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
  const std::uint64_t key = library.FindByName("Desk").key;
  AssetCache assets;
  content::Scene scene = SceneFromRecord(library.LoadScene(key), "Desk", &assets);
  EXPECT_THAT(scene.entities, IsEmpty());
  const auto stored = library.LoadHistory(key);
  ASSERT_TRUE(stored.has_value());
  content::EditHistory history = HistoryFromRecord(*stored, "Desk", &assets);
  ASSERT_EQ(history.done().size(), 3u);
  EXPECT_EQ(history.done()[1].label, "scale 'exhibit' and more");
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(scene.Find("exhibit")->model.map_from_model.scale, 2);
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(scene.Find("exhibit")->model.map_from_model.scale, 1);
  EXPECT_LT((scene.Find("exhibit")->model.map_from_model.translation - Eigen::Vector3d(1, 2, 3)).norm(),
            1e-9);
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_THAT(scene.entities, IsEmpty());
}

TEST(CommandLine, AddsModelsAndSignpostsToASavedMap) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  const std::string model = folder.Write("exhibit.glb", {glb.begin(), glb.end()}).string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Desk", "Kiosk"}) {
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
    }
  }
  const auto arguments = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"content", "add", "--library", path, "--map", "Desk"});
    return more;
  };
  const auto added = [&](const std::vector<std::string>& more) {
    const Outcome outcome = RunDocent(arguments(more));
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
    return outcome.output;
  };
  EXPECT_EQ(added({model, "--at", "1", "-2", "3.5", "--scale", "0.25", "--yaw", "-90"}), "exhibit\n");
  EXPECT_EQ(added({model, "--at", "0", "0", "0", "--rotation", "0", "1", "0", "0"}), "exhibit-2\n");
  EXPECT_EQ(added({model, "--at", "0", "0", "0", "--name", "obelisk"}), "obelisk\n");
  EXPECT_EQ(added({"--signpost", "To the kiosk", "--at", "-1", "0", "2", "--to", "Kiosk", "--height", "0.5",
                   "--direction", "-2", "0", "0"}),
            "sign-1\n");
  EXPECT_EQ(added({"--signpost", "Café", "--at", "-1", "0", "2", "--quiet"}), "");

  const Outcome list = RunDocent({"content", "list", "--library", path, "--json"});
  const auto content = nlohmann::json::parse(list.output).at("content");
  ASSERT_EQ(content.size(), 5u);
  EXPECT_EQ(content[0]["position_m"], nlohmann::json({1.0, -2.0, 3.5}));
  EXPECT_EQ(content[0]["scale"], 0.25);
  EXPECT_EQ(content[0]["file"], "exhibit.glb");
  EXPECT_EQ(content[3]["to_map"], "Kiosk");
  EXPECT_EQ(content[3]["direction"], nlohmann::json({-1.0, 0.0, 0.0}));
  EXPECT_TRUE(content[4]["direction"].is_null());
  EXPECT_EQ(content[4]["text"], "Café");
  {
    const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    const maps::SceneRecord record = library.LoadScene(library.FindByName("Desk").key);
    EXPECT_EQ(record.assets.size(), 1u) << "the same model is stored once";
    AssetCache assets;
    const content::Scene scene = SceneFromRecord(record, "Desk", &assets);
    const engine::Sim3& upright = scene.entities[0].model.map_from_model;
    // Up is -y of a map without keyframes. At yaw 0 the front faces -z; -90 degrees turn it clockwise seen
    // from above.
    EXPECT_LT((upright.rotation * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitY()).norm(), 1e-9);
    EXPECT_LT((upright.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitX()).norm(), 1e-9);
    const engine::Sim3& free = scene.entities[1].model.map_from_model;
    EXPECT_LT((free.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_EQ(scene.entities[3].signpost.height_m, 0.5);
  }

  const auto list_content = [&] { return RunDocent({"content", "list", "--library", path}).output; };
  const std::string before = list_content();
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--name", "obelisk"}), 1, "already a 'obelisk'");
  ExpectErrorLine(arguments({"none.glb", "--at", "0", "0", "0"}), 1, "none.glb");
  ExpectErrorLine(arguments({"--signpost", "x", "--at", "0", "0", "0", "--to", "Nowhere"}), 1, "Nowhere");
  ExpectErrorLine(arguments({"--signpost", std::string(10'001, 'x'), "--at", "0", "0", "0"}), 1,
                  "10000 bytes");
  ExpectErrorLine(arguments({"--signpost", "caf\xE9", "--at", "0", "0", "0"}), 1, "UTF-8");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "1e300"}), 2, "--at");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--direction", "0", "0", "1"}), 2, "--direction");
  ExpectErrorLine(arguments({"--signpost", "x", "--at", "0", "0", "0", "--direction", "0", "0", "0"}), 2,
                  "too short");
  ExpectErrorLine(arguments({model, "--at", "0", "0"}), 2, "--at");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "nan"}), 2, "'nan' is not a number");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--scale", "1e12"}), 2, "--scale");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--scale", "0"}), 2, "--scale");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--rotation", "1", "1", "0", "0"}), 2, "length 1");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--signpost", "x"}), 2, "excludes");
  ExpectErrorLine(arguments({model}), 2, "--at is required");
  ExpectErrorLine(arguments({"--at", "0", "0", "0"}), 2, "--signpost TEXT, --label TEXT or --trail POINTS");
  EXPECT_EQ(list_content(), before);

  ExpectErrorLine(arguments({"--signpost", "x", "--at", "0", "0", "0", "--to", "Desk"}), 1, "its own map");
  EXPECT_EQ(list_content(), before);

  EXPECT_EQ(RunDocent({"maps", "policy", "Desk", "read-only", "--library", path}).exit_status, 0);
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0"}), 1, "read-only");
  EXPECT_EQ(RunDocent({"maps", "policy", "Desk", "augment-only", "--library", path}).exit_status, 0);
  EXPECT_EQ(RunDocent({"content", "remove", "exhibit", "--map", "Desk", "--library", path}).exit_status, 0);
  EXPECT_EQ(RunDocent({"content", "remove", "exhibit-2", "obelisk", "--map", "Desk", "--library", path})
                .exit_status,
            0);
  ExpectErrorLine({"content", "remove", "exhibit", "--map", "Desk", "--library", path}, 1, "no 'exhibit'");
  const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
  EXPECT_TRUE(library.LoadScene(library.FindByName("Desk").key).assets.empty());
}

// A library of three maps without keyframes.
class TourCommands : public ::testing::Test {
 protected:
  TourCommands() {
    maps::Library library = maps::Library::Open(path_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Lions", "Desk 3", "Masks"})
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  }
  std::vector<std::string> Tour(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"maps", "tour"});
    arguments.insert(arguments.end(), {"--library", path_});
    return arguments;
  }

  const TemporaryFolder folder_;
  const std::string path_ = (folder_ / "museum.docent").string();
};

TEST_F(TourCommands, CreateShowChangeAndRemoveTours) {
  EXPECT_THAT(RunDocent(Tour({"list"})).output, HasSubstr("no tour"));
  const Outcome created = RunDocent(
      Tour({"create", "Best of", "--stops", "Masks", "Desk 3", "--minutes", "20", "--language", "DE"}));
  EXPECT_EQ(created.exit_status, 0) << created.errors;
  EXPECT_EQ(RunDocent(Tour({"list"})).output, "Best of                      2 stops    20 min  de\n");
  const auto shown = nlohmann::json::parse(RunDocent(Tour({"show", "Best of", "--json"})).output);
  EXPECT_EQ(shown.at("stops"), (nlohmann::json{"Masks", "Desk 3"}));
  EXPECT_EQ(shown.at("minutes"), 20);
  EXPECT_EQ(shown.at("language"), "de");

  EXPECT_EQ(RunDocent({"maps", "rename", "Desk 3", "Kiosk", "--library", path_}).exit_status, 0);
  EXPECT_THAT(RunDocent(Tour({"show", "Best of"})).output, HasSubstr("2 Kiosk"));
  EXPECT_EQ(RunDocent(Tour({"edit", "Best of", "--stops", "Lions", "Masks", "Kiosk", "--no-minutes",
                            "--no-language"}))
                .exit_status,
            0);
  const auto list = nlohmann::json::parse(RunDocent(Tour({"list", "--json"})).output).at("tours");
  EXPECT_EQ(list.at(0).at("stops"), (nlohmann::json{"Lions", "Masks", "Kiosk"}));
  EXPECT_TRUE(list.at(0).at("minutes").is_null());
  EXPECT_TRUE(list.at(0).at("language").is_null());

  EXPECT_EQ(RunDocent(Tour({"rename", "Best of", "All"})).exit_status, 0);
  EXPECT_EQ(RunDocent(Tour({"remove", "All"})).exit_status, 0);
  EXPECT_THAT(RunDocent(Tour({"list"})).output, HasSubstr("no tour"));
}

TEST_F(TourCommands, RefuseWhatIsNoTour) {
  ExpectErrorLine(Tour({"create", "All"}), 2, "--stops is required");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Ships"}), 1, "no map named 'Ships'");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Lions", "Masks", "Lions"}), 1, "'Lions' is given twice");
  ExpectErrorLine(Tour({"create", "", "--stops", "Lions"}), 1, "its name does not have 1 to 200 bytes");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Lions", "--minutes", "0"}), 2, "--minutes");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Lions", "--language", "12"}), 2, "--language");
  ExpectErrorLine(Tour({"show", "All"}), 1, "no tour named 'All'");
  EXPECT_EQ(RunDocent(Tour({"create", "All", "--stops", "Lions"})).exit_status, 0);
  ExpectErrorLine(Tour({"create", "All", "--stops", "Masks"}), 1, "already a tour named 'All'");
  ExpectErrorLine(Tour({"edit", "All"}), 1, "Nothing to change");
  ExpectErrorLine(Tour({"edit", "All", "--minutes", "5", "--no-minutes"}), 2, "excludes");
  ExpectErrorLine(Tour({"rename", "Some", "More"}), 1, "no tour named 'Some'");
  ExpectErrorLine({"tour", "--tour", "Some", "--library", path_, "--camera", "sim:cylinder:20", "--headless"},
                  1, "no tour named 'Some'");
}

TEST_F(TourCommands, AskBeforeAStopIsRemoved) {
  EXPECT_EQ(RunDocent(Tour({"create", "All", "--stops", "Lions", "Masks"})).exit_status, 0);
  const Outcome refused = RunDocent({"maps", "remove", "Masks", "--library", path_});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_THAT(refused.output, HasSubstr("the tour 'All' stops at 'Masks'"));
  EXPECT_THAT(refused.errors, HasSubstr("1 tour stops at 'Masks', which was not removed; with --force"));
  EXPECT_EQ(RunDocent({"maps", "remove", "Masks", "--force", "--library", path_}).exit_status, 0);
  EXPECT_THAT(RunDocent(Tour({"show", "All"})).output, Not(HasSubstr("Masks")));
  // The last stop leaves a tour without stops, along which nobody can be led.
  EXPECT_EQ(RunDocent({"maps", "remove", "Lions", "--force", "--library", path_}).exit_status, 0);
  ExpectErrorLine({"tour", "--tour", "All", "--library", path_, "--camera", "sim:cylinder:20", "--headless"},
                  1, "has no stops");
}

TEST_F(TourCommands, MentionToursThatAreExportedWithoutAndImportedWithTheirMaps) {
  EXPECT_EQ(RunDocent(Tour({"create", "All", "--stops", "Lions"})).exit_status, 0);
  const std::string other = (folder_ / "other.docent").string();
  EXPECT_THAT(RunDocent({"maps", "export", "Lions", "--library", path_, "--output", other}).output,
              HasSubstr("1 tour that stops there was left out"));
  EXPECT_THAT(RunDocent({"maps", "import", path_, "--library", other}).output, HasSubstr("tour All\n"));
}

TEST(CommandLine, ExportsImportsJoinsAndRecoversMaps) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string(), other = (folder / "desk.docent").string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Desk", maps::Policy::kOpen, nullptr, nullptr});
  }
  EXPECT_EQ(RunDocent({"maps", "export", "Desk", "--library", path, "--output", other}).exit_status, 0);
  EXPECT_THAT(RunDocent({"maps", "import", other, "--library", path}).output, HasSubstr("Desk (2)"));
  EXPECT_EQ(maps::Library::Open(path, maps::Access::kReadOnly).List().size(), 2u);
  EXPECT_THAT(RunDocent({"maps", "optimize", "--library", path}).output,
              HasSubstr("Desk too small to adjust"));
  ExpectErrorLine({"maps", "join", "Desk", "Desk (2)", "--library", path}, 1, "cannot be joined, because");
  ExpectErrorLine({"maps", "join", "Desk", "Desk", "--library", path}, 1, "itself");
  ExpectErrorLine({"maps", "join", "Desk", "Kiosk", "--library", path}, 1, "Kiosk");
  for (const char* name : {"desk.ply", "desk.png", "colmap"}) {
    const std::string output = (folder / name).string();
    EXPECT_EQ(RunDocent({"maps", "export", "Desk", "--library", path, "--output", output}).exit_status, 0);
    EXPECT_TRUE(std::filesystem::exists(output));
    ExpectErrorLine({"maps", "export", "Desk", "--library", path, "--output", output}, 1, "already exists");
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "colmap/points3D.txt"));
  ExpectErrorLine({"maps", "export", "Desk", "--library", path, "--output", (folder / "a.obj").string()}, 1,
                  "unknown file type");
  const std::string saved = (folder / "saved.docent").string();
  EXPECT_THAT(RunDocent({"maps", "recover", "--library", path, "--output", saved}).output,
              HasSubstr("2 maps recovered completely and 0 partly"));
  ExpectErrorLine({"maps", "recover", "--library", path, "--output", saved}, 1, "exists already");
}

}  // namespace
}  // namespace docent::app
