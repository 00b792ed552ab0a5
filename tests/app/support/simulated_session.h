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

// What a session made of one source.
struct SourceRun {
  std::vector<engine::TrackedFrame> frames;
  std::vector<Session::MapState> maps;  // those that exist at the end
  std::vector<std::string> map_events;  // in words
};

// Runs a session over a source, from its first image to Finish.
inline SourceRun RunSource(std::unique_ptr<FrameSource> source, Pace pace, const SessionOptions& options,
                           maps::Library* library, std::vector<TimedCommand> script = {}) {
  CalibratedCamera camera = Calibrate(std::move(source), std::nullopt);
  Session session(options, {camera.model}, library);
  FrameLoopOptions loop;
  loop.pace = pace;
  loop.script = std::move(script);
  loop.script_name = "script";
  SourceRun run;
  RunFrames(&camera, &session, loop, [&](const engine::TrackedFrame& frame) { run.frames.push_back(frame); },
            {});
  session.Finish();
  for (const Session::MapState& map : session.Maps()) {
    if (!map.discarded && map.joined_into == 0) run.maps.push_back(map);
  }
  for (const Event& event : session.TakeEvents()) {
    if (event.event == "map") run.map_events.push_back(event.detail);
  }
  return run;
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
