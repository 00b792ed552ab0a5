// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/app/support/simulated_session.h"

// Once around a tower with a focal length that is two percent off: on its return the camera sees places that
// it has seen before, but the drifted map has them elsewhere (ptamm §6.2, Fig. 15).
namespace docent::app {
namespace {

using simulated_session::Feed;
using simulated_session::Seen;

struct Round {
  int closed = 0;
  int lost = 0;  // frames, after the first pose
  // Largest rotation error of the poses of the last second relative to those of one round before, when the
  // camera was at the same places.
  double wrong_deg = 0;
};

Round GoRound(bool close_loops) {
  constexpr double kRound_s = 26.4, kFrameRate_hz = 15;
  SimulationOptions simulated;
  simulated.camera = SimulatedCamera(320);
  simulated.frame_rate_hz = kFrameRate_hz;
  simulated.duration_s = kRound_s + 3;
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("loop:1", simulated);
  engine::CameraModel::Intrinsics assumed = simulation->camera().intrinsics();
  assumed.fx *= 1.02;
  assumed.fy *= 1.02;
  const auto lens = std::make_shared<engine::CameraModel>(simulation->camera().lens(), assumed,
                                                          simulation->camera().distortion());
  SessionOptions options = simulated_session::Options(Pace::kLockstep, "round");
  options.mapper.loops.enabled = close_loops;
  Session session(options, {lens}, nullptr);
  const Seen seen = Feed(simulation, Pace::kLockstep, &session);
  Round round;
  round.closed = session.MappingTimes().loops_closed;
  bool begun = false;
  for (const engine::TrackedFrame& frame : seen.frames) {
    const bool has_pose = engine::HasPose(frame.state);
    begun = begun || has_pose;
    round.lost += begun && !has_pose;
  }
  const std::size_t a_round = static_cast<std::size_t>(std::lround(kRound_s * kFrameRate_hz));
  for (std::size_t i = seen.frames.size() - static_cast<std::size_t>(kFrameRate_hz); i < seen.frames.size();
       ++i) {
    const engine::TrackedFrame &now = seen.frames[i], &then = seen.frames[i - a_round];
    const engine::Rotation3 tracked = now.camera_from_map.rotation * then.camera_from_map.rotation.inverse();
    const int frame = static_cast<int>(i);
    const engine::Rotation3 truth = simulation->world_from_camera(frame).rotation.inverse() *
                                    simulation->world_from_camera(frame - static_cast<int>(a_round)).rotation;
    constexpr double kDegrees = 57.29577951308232;
    round.wrong_deg = std::max(round.wrong_deg, kDegrees * (tracked * truth.inverse()).Angle());
  }
  return round;
}

TEST(Loop, IsClosedWhenTheCameraIsBackWhereItBegan) {
  const Round round = GoRound(true);
  EXPECT_EQ(round.closed, 1);
  EXPECT_EQ(round.lost, 0);
  EXPECT_LT(round.wrong_deg, 1.0);
}

}  // namespace
}  // namespace docent::app
