// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_files.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>

#include "app/files/text_file.h"
#include "app/script/script_file.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

engine::CameraModel CameraWithFocalLength(double focal_px) {
  return {engine::LensModel::kRadialTangential, {640, 480, focal_px, focal_px, 320, 240}, {}};
}

TEST(GuideFiles, LogContentWhereTheCalibrationOfTheFrameShowsIt) {
  const TemporaryFolder folder;
  GuideRequest request;
  request.output = folder / "out";
  const engine::CameraModel first = CameraWithFocalLength(500);
  GuideFiles files(request, first);
  auto scene = std::make_shared<content::Scene>();
  content::Entity& sign = scene->entities.emplace_back();
  sign.kind = content::Entity::Kind::kSignpost;
  sign.name = "sign-1";
  sign.signpost.anchor = {1, 0, 5};
  ShownFrame frame;
  frame.tracked.state = engine::TrackingState::kSixDof;
  frame.shown.map_name = "Hall";
  frame.shown.scene = scene;
  files.Add(frame);
  frame.camera = std::make_shared<engine::CameraModel>(CameraWithFocalLength(400));
  files.Add(frame);
  files.Close();
  const std::string text = ReadTextFile(folder / "out/augmentations.csv", 10'000);
  EXPECT_THAT(text, HasSubstr("Hall,sign-1,420,240\n")) << "320 + 500 / 5";
  EXPECT_THAT(text, HasSubstr("Hall,sign-1,400,240\n")) << "320 + 400 / 5";
}

// While an instance exists, no file may become larger than a few bytes, as on a full disk.
class FullDisk {
 public:
  FullDisk() {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_limit_);
    rlimit limit = old_limit_;
    limit.rlim_cur = 100;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &old_limit_);
    std::signal(SIGXFSZ, old_handler_);
  }

 private:
  rlimit old_limit_{};
  void (*old_handler_)(int) = nullptr;
};

TEST(GuideFiles, EndOnAFullDiskAndSaySoOnceAndAtTheEnd) {
  const TemporaryFolder folder;
  GuideRequest request;
  request.output = folder / "out";
  request.record_script = folder / "script.txt";
  const engine::CameraModel first = CameraWithFocalLength(500);
  GuideFiles files(request, first);
  const std::vector<Event> events = {{std::chrono::seconds(1), "map", std::string(1000, 'x')}};
  {
    const FullDisk full;
    EXPECT_EQ(ErrorOf([&] { files.Add(events); }), "");
  }
  EXPECT_THAT(files.TakeProblem(), HasSubstr("events.csv"));
  EXPECT_EQ(files.TakeProblem(), "");
  files.Add(events);
  files.Add({std::chrono::seconds(2), 0, Undo{}}, 0);
  EXPECT_THAT(ErrorOf([&] { files.Close(); }), HasSubstr("events.csv"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out/events.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/events.csv.part"));
  EXPECT_THAT(ReadScript(folder / "script.txt"), SizeIs(1)) << "it may be on another disk";
}

TEST(GuideFiles, AreMissingInAKioskWhoseDiskIsFullAtTheStart) {
  const TemporaryFolder folder;
  GuideRequest request;
  request.output = folder.Write("file", "") / "out";
  const engine::CameraModel first = CameraWithFocalLength(500);
  EXPECT_THAT(ErrorOf([&] { GuideFiles files(request, first); }), HasSubstr("out"));
  request.kiosk_code = "1234";
  GuideFiles files(request, first);
  EXPECT_THAT(files.TakeProblem(), HasSubstr("out"));
  files.Add({{std::chrono::seconds(1), "map", "entered Hall"}});
}

TEST(GuideFiles, KeepTheFilesOfARunThatCrashed) {
  const TemporaryFolder folder;
  folder.Write("out/events.csv.part", "why it crashed");
  GuideRequest request;
  request.output = folder / "out";
  const engine::CameraModel first = CameraWithFocalLength(500);
  GuideFiles files(request, first);
  files.Close();
  EXPECT_EQ(ReadAll(folder / "out/events.csv.part.1"), "why it crashed");
}

TEST(GuideFiles, RecordCommandsOfASecondCameraAsComments) {
  const TemporaryFolder folder;
  GuideRequest request;
  request.record_script = folder / "script.txt";
  const engine::CameraModel first = CameraWithFocalLength(500);
  GuideFiles files(request, first);
  files.Add({std::chrono::seconds(2), 0, PlaceSignpost{"one", {10, 20}, ""}}, 0);
  files.Add({std::chrono::seconds(1), 0, PlaceSignpost{"two", {30, 40}, ""}}, 1);
  files.Add({std::chrono::seconds(3), 0, Undo{}}, 0);
  files.Close();
  const std::vector<TimedCommand> read = ReadScript(folder / "script.txt");
  ASSERT_THAT(read, SizeIs(2));
  EXPECT_EQ(std::get<PlaceSignpost>(read[0].command).text, "one");
  EXPECT_TRUE(std::holds_alternative<Undo>(read[1].command));
  EXPECT_THAT(ReadTextFile(folder / "script.txt", 10'000), HasSubstr("\n# camera 2: 1 signpost "));
}

}  // namespace
}  // namespace docent::app
