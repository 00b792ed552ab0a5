// SPDX-License-Identifier: Apache-2.0
// Tests of the real program on simulated input: evaluate, author and tour.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "app/demo/exhibit_model.h"
#include "app/evaluation/simulated_truth.h"
#include "app/files/text_file.h"
#include "app/simulator/simulation.h"
#include "content/asset.h"
#include "maps/library/library.h"
#include "maps/library/session_lock.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// A museum of two bays: its simulation, the script that authors it, and the time at which the visits begin.
struct Museum {
  std::unique_ptr<Simulation> simulation = MakeSimulation("museum:2");
  std::string camera = "sim:museum:2";
  std::string visits_from;
  std::string script;

  explicit Museum(const std::string& model) {
    const Timestamp begin = simulation->time(0);
    const auto segments = SegmentsOf(*simulation);
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const std::string& label = segments[i].label;
      const Timestamp start = segments[i].time - begin;
      if (label.starts_with("visit") && visits_from.empty()) visits_from = FormatSeconds(start);
      if (!label.starts_with("build")) continue;
      const Timestamp length = segments[i + 1].time - segments[i].time;
      const std::string place = FormatSeconds(start + length * 3 / 5);
      script += FormatSeconds(start) + " map new \"Bay " + label.substr(5) + "\"\n";
      script += place + " place " + model + " at pixel 320 290 scale 0.3\n";
      script += place + " signpost \"This is bay " + label.substr(5) + "\" at pixel 400 280\n";
      script += FormatSeconds(start + length) + " map stop\n";
    }
  }
};

std::string WriteModel(const TemporaryFolder& folder) {
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  folder.Write("exhibit.glb", {glb.begin(), glb.end()});
  return "exhibit.glb";
}

std::vector<std::string> AuthorArguments(const TemporaryFolder& folder, const Museum& museum) {
  return {"author",
          "--library",
          (folder / "l.docent").string(),
          "--camera",
          museum.camera,
          "--until",
          museum.visits_from,
          "--headless",
          "--script",
          (folder / "script.txt").string(),
          "--output",
          (folder / "author").string()};
}

TEST(Guide, EvaluationInLockstepIsBitIdenticalOnEveryRun) {
  const TemporaryFolder folder;
  std::vector<std::string> trajectories, events;
  std::vector<std::vector<Row>> frames;
  for (const char* name : {"first", "second"}) {
    const auto output = folder / name;
    const Outcome outcome =
        RunDocent({"evaluate", "sim:cylinder:20", "--output", output.string(), "--pace", "lockstep"});
    ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
    const auto report = nlohmann::json::parse(ReadAll(output / "report.json"));
    const auto& sequence = report.at("sequences").at(0);
    EXPECT_EQ(sequence.at("frames"), 100);
    EXPECT_GE(sequence.at("tracked"), 95);
    frames.push_back(ReadFrames(output / "cylinder-20" / "frames.csv"));
    for (Row& row : frames.back()) row.erase("tracking_ms");
    trajectories.push_back(ReadAll(output / "cylinder-20" / "trajectory.txt"));
    events.push_back(ReadAll(output / "cylinder-20" / "events.csv"));
    EXPECT_THAT(ReadAll(output / "report.html"), HasSubstr("cylinder"));
  }
  EXPECT_EQ(frames[0].size(), 100u);
  EXPECT_EQ(frames[0], frames[1]);
  EXPECT_FALSE(trajectories[0].empty());
  EXPECT_EQ(trajectories[0], trajectories[1]);
  EXPECT_EQ(events[0], events[1]);
}

TEST(Guide, ReportsTheSameDistributionForAnyNumberOfJobs) {
  const TemporaryFolder folder;
  std::vector<std::string> trajectories;
  std::vector<nlohmann::json> rows;
  for (const char* jobs : {"1", "2"}) {
    const auto output = folder / jobs;
    const Outcome outcome =
        RunDocent({"evaluate", "sim:cylinder:20", "--output", output.string(), "--pace", "lockstep",
                   "--seeds", "2", "--starts", "2", "--window", "1", "--jobs", jobs});
    ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
    EXPECT_THAT(outcome.output, HasSubstr("cylinder-20, hybrid: 4 runs (2 seeds, 2 starts, 1 s each)"));
    const auto distribution =
        nlohmann::json::parse(ReadAll(output / "report.json")).at("sequences").at(0).at("distribution");
    ASSERT_EQ(distribution.at("runs").size(), 4u);
    EXPECT_EQ(distribution.at("runs").at(3).at("seed"), 2);
    EXPECT_EQ(distribution.at("runs").at(3).at("first_frame"), 70);
    rows.push_back(distribution.at("runs"));
    for (auto& row : rows.back()) row.erase("tracking_median_ms");
    const auto run = output / "cylinder-20" / "seed-2-start-1";
    const std::vector<Row> frames = ReadFrames(run / "frames.csv");
    EXPECT_EQ(frames.size(), 30u) << "one second";
    trajectories.push_back(ReadAll(run / "trajectory.txt"));
    for (const auto& file : std::filesystem::directory_iterator(run))
      EXPECT_NE(file.path().extension(), ".png") << "images are written for a single run only";
    EXPECT_THAT(ReadAll(output / "report.html"), HasSubstr("of each run, sorted"));
  }
  EXPECT_EQ(rows[0], rows[1]);
  EXPECT_EQ(trajectories[0], trajectories[1]);
}

TEST(Guide, ComparesBothEnginesAndStitchesPanoramas) {
  const TemporaryFolder folder;
  const auto output = folder / "report";
  const Outcome outcome = RunDocent(
      {"evaluate", "sim:cylinder:0", "--output", output.string(), "--pace", "lockstep", "--compare"});
  ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
  const auto report = nlohmann::json::parse(ReadAll(output / "report.json"));
  ASSERT_EQ(report.at("sequences").size(), 1u);
  ASSERT_EQ(report.at("compared").size(), 1u);
  const auto& hybrid = report.at("sequences").at(0);
  EXPECT_EQ(hybrid.at("engine"), "hybrid");
  EXPECT_EQ(report.at("compared").at(0).at("engine"), "sixdof");
  EXPECT_EQ(report.at("compared").at(0).at("keyframes").at("panorama"), 0);
  EXPECT_GT(hybrid.at("keyframes").at("panorama"), 2);
  // The camera rotates by 90 degrees about its centre, so that its position is undefined.
  EXPECT_GT(hybrid.at("tracked"), 95);
  EXPECT_EQ(hybrid.at("directions_only_frames"), hybrid.at("tracked"));
  EXPECT_TRUE(hybrid.at("ate_rmse_m").is_null());
  EXPECT_LT(std::abs(hybrid.at("turn_error_deg").get<double>()), 0.3);
  for (const char* name : {"cylinder-0", "cylinder-0-sixdof"})
    EXPECT_EQ(ReadFrames(output / name / "frames.csv").size(), 100u) << name;
  const auto is_png = [](const std::filesystem::path& path) {
    return path.extension() == ".png" && ReadAll(path).starts_with("\x89PNG\r\n");
  };
  const auto images = [&](const char* name) {
    const std::filesystem::directory_iterator files(output / name);
    return std::count_if(begin(files), end(files), [&](const auto& entry) { return is_png(entry.path()); });
  };
  EXPECT_EQ(images("cylinder-0"), 1);
  EXPECT_EQ(images("cylinder-0-sixdof"), 0);
  EXPECT_THAT(
      ReadAll(output / "report.html"),
      AllOf(HasSubstr("<h4>hybrid</h4>"), HasSubstr("<h4>sixdof</h4>"), HasSubstr("data:image/png;base64,")));
}

// Adds a tour and the signposts along it to a library with two bays.
void LeadFromBayToBay(const std::string& library) {
  for (const auto& [from, to] : {std::pair("Bay 0", "Bay 1"), std::pair("Bay 1", "Bay 0")}) {
    const Outcome signpost = RunDocent({"content", "add", "--signpost", "Further on", "--to", to, "--map",
                                        from, "--at", "5", "0", "0", "--library", library});
    EXPECT_EQ(signpost.exit_status, 0) << signpost.errors;
  }
  const Outcome tour =
      RunDocent({"maps", "tour", "create", "Bays", "--stops", "Bay 1", "Bay 0", "--library", library});
  EXPECT_EQ(tour.exit_status, 0) << tour.errors;
}

TEST(Guide, AuthorsMapsThatATourRecognizesAndLeavesUnchanged) {
  const TemporaryFolder folder;
  const Museum museum(WriteModel(folder));
  folder.Write("script.txt", museum.script);
  const std::vector<std::string> author = AuthorArguments(folder, museum);
  const Outcome authored = RunDocent(author);
  ASSERT_EQ(authored.exit_status, 0) << authored.errors;
  const maps::Library library = maps::Library::Open(folder / "l.docent", maps::Access::kReadOnly);
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_EQ(library.List().size(), 2u);
  EXPECT_EQ(library.LoadScene(library.FindByName("Bay 0").key).assets.size(), 1u);

  const std::string path = (folder / "l.docent").string();
  LeadFromBayToBay(path);
  folder.Write("visit.txt", std::string("6 tour back\n6.5 tour restart\n"));
  const std::string before = ReadAll(path);
  const Outcome toured =
      RunDocent({"tour", "--library", path, "--camera", museum.camera, "--from", museum.visits_from,
                 "--headless", "--tour", "Bays", "--script", (folder / "visit.txt").string(), "--output",
                 (folder / "tour").string(), "--log", (folder / "visits").string()});
  ASSERT_EQ(toured.exit_status, 0) << toured.errors;
  EXPECT_EQ(before, ReadAll(folder / "l.docent"));

  const auto labels = SegmentsOf(*museum.simulation);
  int frames = 0, right = 0, wrong = 0;
  for (const Row& row : ReadFrames(folder / "tour" / "frames.csv")) {
    const TimedLabel* label = FindLabel(labels, *ParseSeconds(row.at("timestamp")));
    if (label == nullptr || !label->label.starts_with("visit")) continue;
    ++frames;
    if (row.at("map").empty()) continue;
    ++(row.at("map") == "Bay " + label->label.substr(5) ? right : wrong);
  }
  EXPECT_GT(right, frames * 8 / 10) << "of " << frames;
  EXPECT_EQ(wrong, 0);
  const std::string drawn = ReadAll(folder / "tour" / "augmentations.csv");
  EXPECT_THAT(drawn, AllOf(HasSubstr(",Bay 0,exhibit,"), HasSubstr(",Bay 1,sign-1,")));
  // The visits begin in the last bay.
  EXPECT_THAT(ReadAll(folder / "tour" / "events.csv"),
              AllOf(HasSubstr(",tour,\"arrived at 'Bay 1', stop 1 of 2\""),
                    HasSubstr(",tour,\"arrived at 'Bay 0', stop 2 of 2\""),
                    HasSubstr(",tour,finished; 2 of 2 stops seen"), HasSubstr(",command,tour back"),
                    HasSubstr(",tour,\"going back to 'Bay 1', stop 1 of 2\""),
                    HasSubstr(",command,tour restart"), HasSubstr(",tour,the visitor begins anew")));

  const std::string page = (folder / "visits.html").string();
  const Outcome reported = RunDocent({"report", (folder / "visits").string(), "--output", page});
  EXPECT_EQ(reported.exit_status, 0) << reported.errors;
  EXPECT_THAT(reported.output, HasSubstr("the report is in " + page));
  EXPECT_THAT(ReadAll(page), AllOf(HasSubstr("<td>Bay 0</td>"), HasSubstr("<td>Bay 1</td>")));
}

TEST(Guide, TheDemonstrationMakesMapsAndLeadsThroughThem) {
  const TemporaryFolder folder;
  const Outcome demo = RunDocent({"demo", "--headless", "--output", (folder / "demo").string()});
  ASSERT_EQ(demo.exit_status, 0) << demo.errors;
  EXPECT_THAT(demo.output, AllOf(HasSubstr("3 maps were built and content was placed in them.\n"),
                                 HasSubstr(" images, a wrong one in 0 %.\n"),
                                 HasSubstr("Median placement error: "), HasSubstr("Results: ")));
  const maps::Library library = maps::Library::Open(folder / "demo/museum.docent", maps::Access::kReadOnly);
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_EQ(library.List().size(), 3u);
  for (const char* name : {"tour-Bay-0.png", "tour-Bay-1.png", "tour-Bay-2.png", "map-Bay-0.png"})
    EXPECT_THAT(ReadAll(folder / "demo" / name), StartsWith("\x89PNG\r\n")) << name;
  EXPECT_GT(std::filesystem::file_size(folder / "demo/tour.mp4"), 10000u);
  EXPECT_THAT(ReadAll(folder / "demo/report.html"), HasSubstr("tour"));
  const auto report = nlohmann::json::parse(ReadAll(folder / "demo/report.json"));
  const nlohmann::json& author = report.at("sequences").at(0);
  EXPECT_EQ(author.at("name"), "author");
  EXPECT_EQ(author.at("engine"), "hybrid");
  EXPECT_GT(author.at("mapping_s").at("bundle_adjustment").get<double>(), 0);
}

TEST(Guide, TheDemonstrationKeepsALibraryThatIsNotItsOwn) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Lions", maps::Policy::kOpen, nullptr, nullptr});
  }
  const std::vector<std::string> demo = {"demo", "--headless", "--output", folder.path().string()};
  ExpectErrorLine(demo, 1, "museum.docent' already exists and is not of an earlier demonstration");
  EXPECT_EQ(maps::Library::Open(path, maps::Access::kReadOnly).List().size(), 1u);
}

TEST(Guide, TheDemonstrationReplacesItsEarlierLibraryUnlessAnAuthorHasItOpen) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  for (const char* file : {"exhibit.glb", "author/script.txt.part"}) folder.Write(file, "");
  const maps::SessionLock lock(path, maps::SessionLockKind::kSession);
  ExpectErrorLine({"demo", "--headless", "--output", folder.path().string()}, 1,
                  "is already open in docent author");
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(Guide, AuthorsAndToursWithTwoCamerasInOneMap) {
  const TemporaryFolder folder;
  const std::string library = (folder / "room.docent").string(), output = (folder / "out").string();
  folder.Write("walk.txt", std::string("0.2 map new \"Table\"\n"));
  const std::vector<std::string> cameras = {"--camera", "sim:hand", "--camera", "sim:shoulder", "--headless"};
  const auto with_cameras = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), cameras.begin(), cameras.end());
    return RunDocent(arguments);
  };
  const Outcome authored =
      with_cameras({"author", "--library", library, "--script", (folder / "walk.txt").string(), "--until",
                    "4", "--output", output, "--record", (folder / "view.mp4").string()});
  ASSERT_EQ(authored.exit_status, 0) << authored.errors;
  const auto localized_ratio = [](const std::vector<Row>& rows, const std::string& camera) {
    int frames = 0, poses = 0;
    for (const Row& row : rows) {
      if (row.at("camera") != camera) continue;
      ++frames;
      poses += row.at("map") == "Table";
    }
    return frames > 0 ? static_cast<double>(poses) / frames : 0;
  };
  for (const char* camera : {"0", "1"})
    EXPECT_GT(localized_ratio(ReadFrames(folder / "out/frames.csv"), camera), 0.8);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/trajectory_1.txt"));
  EXPECT_GT(std::filesystem::file_size(folder / "view.mp4"), 10000u);

  const Outcome toured = with_cameras({"tour", "--library", library, "--until", "1.5", "--pace", "lockstep",
                                       "--output", (folder / "tour").string()});
  ASSERT_EQ(toured.exit_status, 0) << toured.errors;
  for (const char* camera : {"0", "1"})
    EXPECT_GT(localized_ratio(ReadFrames(folder / "tour/frames.csv"), camera), 0.8);
}

// Whether the program is killed while the first map is being saved or once it is saved.
class KilledAuthor : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Guide, KilledAuthor, ::testing::Bool(),
                         [](const auto& saved) { return saved.param ? "AfterASave" : "DuringTheFirstSave"; });

TEST_P(KilledAuthor, LeavesAValidLibrary) {
  const TemporaryFolder folder;
  const Museum museum(WriteModel(folder));
  folder.Write("script.txt", museum.script);
  const pid_t child =
      StartDocent(AuthorArguments(folder, museum), (folder / "out").string(), (folder / "err").string());
  // Until SQLite's next checkpoint, the data is in the write-ahead log beside the library.
  const auto written = [&](const char* file) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(folder / file, error);
    return error ? std::uintmax_t{0} : bytes;
  };
  const auto is_time = [&] {
    if (!GetParam()) return written("l.docent") + written("l.docent-wal") >= 100'000;
    bool saved = false;
    ErrorOf([&] {  // until the library is there
      saved = !maps::Library::Open(folder / "l.docent", maps::Access::kReadOnly).List().empty();
    });
    return saved;
  };
  siginfo_t ended{};
  while (!is_time()) {
    waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT);
    if (ended.si_pid == child) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << ReadAll(folder / "err");
  const maps::Library library = maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite);
  EXPECT_THAT(library.Verify(), IsEmpty());
  const auto saved = library.List();
  EXPECT_GE(saved.size(), GetParam() ? 1u : 0u);
  for (const maps::MapInfo& info : saved) EXPECT_GE(library.Load(info.key).snapshot->keyframes.size(), 2u);
}

TEST(Guide, AnInterruptedEvaluationReportsTheFinishedRuns) {
  const TemporaryFolder folder;
  const pid_t child = StartDocent({"evaluate", "sim:cylinder:20,duration=0.3", "sim:museum:2", "--output",
                                   (folder / "report").string(), "--pace", "lockstep"},
                                  (folder / "out").string(), (folder / "err").string());
  siginfo_t ended{};
  while (!std::filesystem::exists(folder / "report/museum-2/frames.csv.part")) {
    waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT);
    if (ended.si_pid == child) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  const std::string errors = ReadAll(folder / "err");
  EXPECT_THAT(errors, HasSubstr("Interrupted"));
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  const auto report = nlohmann::json::parse(ReadAll(folder / "report/report.json"));
  EXPECT_EQ(report.at("sequences").size(), 1u);
}

TEST(Guide, ReportsBadInputInOneLine) {
  const TemporaryFolder folder;
  const std::string library = (folder / "l.docent").string(), output = (folder / "out").string();
  const auto fails = [](const std::vector<std::string>& arguments, const std::string& part) {
    ExpectErrorLine(arguments, 1, part);
  };
  fails({"evaluate", (folder / "nowhere").string(), "--output", output}, "nowhere");
  const auto video = folder.Write("cut.mp4", std::string("\0\0\0\x20"
                                                         "ftypisom\0\0\2\0isomiso2",
                                                         24));
  const auto calibration = folder.Write("c.yaml", "width: 640\nheight: 480\nfy: 500\ncx: 320\ncy: 240\n");
  fails({"evaluate", video.string(), "--output", output}, "cut.mp4");
  fails({"evaluate", "sim:cylinder:20", "--starts", "101", "--output", output}, "has only 100 frames");
  fails({"author", "--library", library, "--camera", "sim:cylinder:20", "--headless", "--calibration",
         calibration.string()},
        "fx");
  const auto damaged = folder.Write("damaged.docent", std::string(5000, 'x'));
  fails({"tour", "--library", damaged.string(), "--camera", "sim:cylinder:20", "--headless"},
        "damaged.docent");
  fails({"tour", "--library", (folder / "none.docent").string(), "--camera", "sim:cylinder:20", "--headless"},
        "none.docent");
  folder.Write("hostile.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4000000000,
      "uri":"../../../etc/passwd"}],"bufferViews":[{"buffer":0,"byteLength":4000000000}]})");
  const auto script = folder.Write("hostile.txt", "0 map new A\n1 place hostile.gltf at pixel 320 240\n");
  fails({"author", "--library", library, "--camera", "sim:cylinder:20", "--headless", "--script",
         script.string()},
        "line 2");
  const std::string target = (folder / "poster.png").string();
  fails({"author", "--library", library, "--camera", "sim:cylinder:20", "--headless", "--target", target,
         "--target-width", "0.4"},
        "poster.png");
  cv::imwrite(target, cv::Mat(300, 400, CV_8UC1, cv::Scalar(200)));
  fails({"author", "--library", library, "--camera", "sim:cylinder:20", "--headless", "--target", target,
         "--target-width", "0.4"},
        "too little detail");
  const auto early = folder.Write("early.txt", "0 map new A\n0.1 signpost \"x\" at pixel 320 240\n");
  fails({"author", "--library", library, "--camera", "sim:cylinder:20", "--headless", "--script",
         early.string()},
        "early.txt, line 2");
}

}  // namespace
}  // namespace docent::app
