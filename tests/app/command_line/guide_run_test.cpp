// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_run.h"

#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/app/support/log_of.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A camera of a known calibration without images.
class CameraWithoutImages : public FrameSource {
 public:
  explicit CameraWithoutImages(bool breaks) : breaks_(breaks) {
    info_.name = "empty";
    info_.known_camera =
        engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 320, 240}, {});
  }
  bool Next(engine::Frame*) override {
    if (breaks_) throw Error("The camera broke.");
    return false;
  }

 private:
  const bool breaks_;
};

std::vector<CalibratedCamera> CamerasWithoutImages(bool breaks) {
  std::vector<CalibratedCamera> cameras;
  cameras.push_back(Calibrate(std::make_unique<CameraWithoutImages>(breaks), std::nullopt));
  return cameras;
}

struct EndOfRun {
  std::string error, log;
};

EndOfRun RunToItsEnd(const GuideRequest& request, std::vector<CalibratedCamera> cameras) {
  EndOfRun end;
  GuideRun run(request, cameras);
  end.log = LogOf(
      [&] { end.error = ErrorOf([&] { run.Run([](const std::shared_ptr<const ShownFrame>&) {}, {}); }); });
  return end;
}

GuideRequest HeadlessRequest() {
  GuideRequest request;
  request.headless = true;
  request.pace = Pace::kLockstep;
  request.language = "en";
  return request;
}

TEST(GuideRun, LogsTheErrorsAfterTheFirst) {
  const TemporaryFolder folder;
  folder.Write("script.txt/file", "");  // A folder, which the script cannot replace.
  GuideRequest request = HeadlessRequest();
  request.may_write = true;
  request.record_script = folder / "script.txt";
  const EndOfRun end = RunToItsEnd(request, CamerasWithoutImages(/*breaks=*/true));
  EXPECT_THAT(end.error, HasSubstr("The camera broke."));
  EXPECT_THAT(end.log, HasSubstr("script.txt"));
}

TEST(GuideRun, LogsTheWarningsOfATourOnce) {
  std::vector<CalibratedCamera> cameras = CamerasWithoutImages(/*breaks=*/false);
  cameras[0].estimated_lens = engine::EstimatedLens{.model = cameras[0].model, .name = "lens"};
  const EndOfRun end = RunToItsEnd(HeadlessRequest(), std::move(cameras));
  EXPECT_EQ(end.error, "");
  const std::string warning = "The calibration of camera \"lens\"";
  EXPECT_THAT(end.log, HasSubstr(warning));
  EXPECT_THAT(end.log.substr(end.log.find(warning) + 1), Not(HasSubstr(warning)));
}

}  // namespace
}  // namespace docent::app
