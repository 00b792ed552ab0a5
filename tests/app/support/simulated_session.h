// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "app/cameras/simulated_source.h"
#include "app/session/frame_loop.h"
#include "app/session/session.h"
#include "app/simulator/simulation.h"

// Helpers for tests that run sessions in the simulated museum.
namespace docent::app::simulated_session {

inline std::shared_ptr<const Simulation> Room(double seconds) {
  SimulationOptions options;
  options.duration_s = seconds;
  return MakeSimulation("museum:2", options);
}

inline CalibratedCamera CameraOf(const std::shared_ptr<const Simulation>& simulation) {
  return Calibrate(OpenSimulation(simulation), std::nullopt);
}

struct Seen {
  std::vector<engine::TrackedFrame> frames;
  int poses = 0;
};

// Feeds a whole simulation to a session and returns its tracked frames.
inline Seen Feed(const std::shared_ptr<const Simulation>& simulation, Pace pace, Session* session,
                 std::vector<TimedCommand> script = {}, const std::filesystem::path& model_folder = {}) {
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = pace;
  loop.script = std::move(script);
  loop.script_name = "script";
  loop.model_folder = model_folder;
  Seen seen;
  RunFrames(&camera, session, loop,
            [&](const engine::TrackedFrame& frame) {
              seen.frames.push_back(frame);
              seen.poses += engine::HasPose(frame.state);
            },
            {});
  session->Finish();
  return seen;
}

inline SessionOptions Options(Pace pace, const std::string& first_map) {
  SessionOptions options;
  options.threaded = pace != Pace::kLockstep;
  options.first_map = first_map;
  return options;
}

// The camera model of the simulation's calibration.
inline std::vector<std::shared_ptr<const engine::CameraModel>> LensOf(const Simulation& simulation) {
  return {std::make_shared<engine::CameraModel>(simulation.calibration())};
}

}  // namespace docent::app::simulated_session
