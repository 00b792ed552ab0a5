// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>

#include "app/session/session.h"
#include "tests/app/support/simulated_session.h"

namespace docent::app {
namespace {

using simulated_session::CameraOf;
using simulated_session::LensOf;
using simulated_session::Options;
using simulated_session::Room;
using ::testing::HasSubstr;

// Throws in the mapper's thread once it has stored some images.
class FailingImageStore : public engine::ImageStore {
 public:
  std::shared_ptr<const engine::ImageFeatures> Store(
      std::shared_ptr<const engine::ImageFeatures> features) override {
    if (++stored_ > 4) throw std::runtime_error("the image store failed");
    return features;
  }
  void EvictAll() override {}

 private:
  std::atomic<int> stored_ = 0;
};

TEST(FailingMapper, IsReportedAtOnceAndTrackingContinues) {
  const auto simulation = Room(4);
  SessionOptions options = Options(Pace::kEager, "Hall");
  options.mapper.images = std::make_shared<FailingImageStore>();
  Session session(options, LensOf(*simulation), nullptr);
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kEager;
  int poses_after = 0;
  std::string warning;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              for (const Event& event : session.TakeEvents()) {
                if (event.event == "warning") warning = event.detail;
              }
              if (!warning.empty()) poses_after += engine::HasPose(frame.state);
            },
            {});
  EXPECT_THAT(
      warning,
      HasSubstr("Mapping has stopped because of an error: the image store failed. Tracking continues"));
  EXPECT_GT(poses_after, 10);
  EXPECT_THROW(session.Finish(), std::runtime_error);
}

}  // namespace
}  // namespace docent::app
