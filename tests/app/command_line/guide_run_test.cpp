// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_run.h"

#include <gmock/gmock.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "tests/app/support/log_of.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
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

// A camera that is unplugged after its first image. `away` is called meanwhile. Then there is no other image,
// or a last one if it returns.
class UnpluggedCamera : public FrameSource {
 public:
  UnpluggedCamera(std::function<void()> away, bool returns) : away_(std::move(away)), returns_(returns) {
    info_.name = "unplugged";
    info_.live = true;
    info_.known_camera =
        engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 320, 240}, {});
  }
  bool Next(engine::Frame* frame) override {
    ++calls_;
    frame->index = calls_ < 4 ? 1 : 2;
    frame->time = Timestamp(1000) * calls_;
    if (calls_ == 1 || calls_ == 4) frame->image = cv::Mat::zeros(480, 640, CV_8UC1);
    if (calls_ == 3) away_();
    return calls_ < (returns_ ? 5 : 3);
  }
  std::string trouble() const override {
    return calls_ == 2 || calls_ == 3 ? "The camera was unplugged." : "";
  }

 private:
  const std::function<void()> away_;
  const bool returns_;
  int calls_ = 0;
};

TEST(GuideRun, SaysThatTheCameraIsAwayWhateverTheVisitorDoes) {
  GuideRun* run = nullptr;
  std::vector<std::string> messages;
  std::vector<CalibratedCamera> cameras;
  cameras.push_back(
      Calibrate(std::make_unique<UnpluggedCamera>(
                    [&] {
                      for (const auto step : {GuideVisitor::Step::kPress, GuideVisitor::Step::kClose}) {
                        const auto frame = run->Lead(0, GuideVisitor{step, {}});
                        messages.push_back(frame ? frame->message : "no frame");
                      }
                    },
                    /*returns=*/false),
                std::nullopt));
  const GuideRequest request = HeadlessRequest();
  GuideRun tour(request, cameras);
  run = &tour;
  tour.Run([](const std::shared_ptr<const ShownFrame>&) {}, {});
  EXPECT_THAT(messages, ElementsAre("The camera was unplugged. There is nothing to open here.",
                                    "The camera was unplugged."));
}

TEST(GuideRun, ShowsNoRefusalFromBeforeTheCameraWasBack) {
  GuideRun* run = nullptr;
  bool was_refused = false;
  std::vector<std::string> messages;  // Since then.
  std::vector<CalibratedCamera> cameras;
  cameras.push_back(Calibrate(std::make_unique<UnpluggedCamera>(
                                  [&] {
                                    run->Lead(0, GuideVisitor{GuideVisitor::Step::kPress, {}});
                                    was_refused = true;
                                  },
                                  /*returns=*/true),
                              std::nullopt));
  const GuideRequest request = HeadlessRequest();
  GuideRun tour(request, cameras);
  run = &tour;
  tour.Run(
      [&](const std::shared_ptr<const ShownFrame>& frame) {
        if (was_refused) messages.push_back(frame->message);
      },
      {});
  EXPECT_THAT(messages, Not(IsEmpty()));
  EXPECT_THAT(messages, Each(Not(HasSubstr("There is nothing to open here."))));
}

}  // namespace
}  // namespace docent::app
