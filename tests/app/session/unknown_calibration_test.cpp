// SPDX-License-Identifier: Apache-2.0
// A session with a camera whose calibration is unknown.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "app/cameras/simulated_source.h"
#include "app/cameras/source_with_size.h"
#include "app/session/frame_loop.h"
#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "tests/support/error_of.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

TEST(SourceWithSize, DeliversAllImagesAndTheirSize) {
  SimulationOptions options;
  options.camera = SimulatedCamera(320);
  options.duration_s = 0.2;
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room", options);
  const SourceWithSize sized = ReadSize(OpenSimulation(simulation));
  EXPECT_EQ(sized.size, cv::Size(320, 240));
  engine::Frame frame;
  for (int i = 0; i < simulation->frame_count(); ++i) {
    ASSERT_TRUE(sized.source->Next(&frame));
    EXPECT_EQ(frame.index, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.time, simulation->time(i));
    EXPECT_EQ(frame.image.size(), sized.size);
  }
  EXPECT_FALSE(sized.source->Next(&frame));
}

class EmptySource : public FrameSource {
 public:
  EmptySource() { info_.name = "nothing"; }
  bool Next(engine::Frame*) override { return false; }
};

TEST(SourceWithSize, ThrowsIfNoImageArrives) {
  EXPECT_THAT(ErrorOf([] { ReadSize(std::make_unique<EmptySource>()); }),
              HasSubstr("'nothing' delivers no image"));
}

TEST(UnknownCalibration, WithCalibrationAutoTheInitialFieldOfViewIs60Degrees) {
  SimulationOptions options;
  options.duration_s = 0.1;
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room", options);
  const CalibratedCamera known = Calibrate(OpenSimulation(simulation), std::nullopt);
  EXPECT_FALSE(known.estimated_lens);
  const CalibratedCamera unknown = Calibrate(OpenSimulation(simulation), kEstimateCalibration);
  ASSERT_TRUE(unknown.estimated_lens);
  EXPECT_EQ(unknown.estimated_lens->model, unknown.model);
  EXPECT_NEAR(unknown.model->intrinsics().fx, 320 / std::tan(M_PI / 6), 1e-9);
}

TEST(UnknownCalibration, IsEstimatedDuringMappingWithoutLosingTrack) {
  SimulationOptions simulation_options;
  simulation_options.duration_s = 5;
  simulation_options.field_of_view_deg = 90;
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room", simulation_options);
  CalibratedCamera camera = Calibrate(OpenSimulation(simulation), kEstimateCalibration);
  SessionOptions options;
  options.threaded = false;
  options.first_map = "Room";
  options.mapper.lens.lenses = EstimatedLensesOf({&camera, 1});
  Session session(options, {camera.model}, nullptr);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  int frames = 0, posed = 0;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              ++frames;
              posed += engine::HasPose(frame.state);
            },
            {});
  session.Finish();
  EXPECT_GE(posed, frames - 2);
  const auto lens = session.EstimatedLensOf(0);
  ASSERT_TRUE(lens);
  EXPECT_LE(lens->focal_sigma, 0.05);
  EXPECT_LT(std::abs(std::log(lens->model->intrinsics().fx / simulation->camera().intrinsics().fx)),
            4 * lens->focal_sigma);
  int events = 0;
  for (const Event& event : session.TakeEvents()) {
    if (event.event != "lens") continue;
    ++events;
    EXPECT_THAT(event.detail, HasSubstr("Estimated calibration of camera \""));
    EXPECT_THAT(event.detail, HasSubstr("focal length "));
  }
  EXPECT_GT(events, 0);
  std::size_t keyframes = 0;
  for (const Session::MapState& map : session.Maps()) {
    if (map.discarded || !map.snapshot) continue;
    // Models of images move with a rolling shutter, but have the lens.
    for (const engine::KeyFrame& keyframe : map.snapshot->keyframes)
      EXPECT_TRUE(keyframe.camera->HasSameLens(*lens->model));
    keyframes += map.snapshot->keyframes.size();
  }
  EXPECT_GT(keyframes, 2u);
}

}  // namespace
}  // namespace docent::app
