// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/cameras/frame_source.h"
#include "app/session/head_control.h"
#include "app/session/pace.h"
#include "app/session/session_options.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"

// Options of each subcommand as plain structs. The command line is parsed into them before anything runs, so
// the rest of the program does not depend on the argument parser.
namespace docent::app {

enum class Verbosity { kQuiet, kNormal, kVerbose };

enum class EngineKind {
  kHybrid,  // With panorama maps.
  kSixDof,  // Plain PTAM, without panorama maps.
};
// What happens when a camera is lost and relocalization finds no known map.
enum class WhenLost {
  kNew,   // A new map is started after a short delay.
  kWait,  // The camera stays lost until it is relocalized in a known map.
};
const char* ToString(EngineKind engine);

struct CameraArguments {
  std::vector<std::string> sources;  // One or two.
  std::vector<std::filesystem::path>
      calibrations;           // By source; missing ones are searched next to the source.
  CameraOptions options;      // Device format; the seed is RunArguments::seed.
  Timestamp from{}, until{};  // Part of the source to use, relative to its first image; 0: no limit.
};

// Options that all subcommands with tracking share.
struct RunArguments {
  CameraArguments cameras;
  std::optional<Pace> pace;  // Empty: the default of ResolvePace.
  EngineKind engine = EngineKind::kHybrid;
  bool headless = false;
  std::optional<std::filesystem::path> output;  // Folder for the run's files.
  std::optional<std::filesystem::path> record;  // Video of the augmented view.
  std::uint64_t seed = 1;
  std::size_t memory_budget_bytes = std::size_t{1} << 30;  // For maps in memory.
  std::optional<HeadPolicy> head;                          // For cameras with a pan-tilt head.
  double baseline_m = 0;                  // Measured distance between the two cameras; 0: not measured.
  Occlusion occlusion = Occlusion::kMap;  // What hides content.
  bool room_light = true;                 // See SessionOptions.
  std::optional<bool> sound;              // Whether sounds are heard; empty: with a window.
  std::optional<std::string> language;    // Of texts, a tag in lower case; empty: that of the locale.
};

struct AuthorOptions {
  RunArguments run;
  std::filesystem::path library;
  std::optional<std::filesystem::path> target;  // Printed planar target that initializes new maps.
  double target_width_m = 0;
  std::optional<std::filesystem::path> script, record_script;
  Timestamp autosave_interval = std::chrono::seconds(10);  // 0: save only when a map is left and at the end.
  std::optional<WhenLost> when_lost;  // Empty: kWait with a window, which offers a choice, else kNew.
  double ui_scale = 1;                // Of the window's panel and texts, times what the monitor suggests.
  std::string hub;                    // Address of the hub that gets what is saved; empty for none.
  bool library_is_copy = false;       // Of the hub, so that what is removed from it is removed there too.
};

struct TourOptions {
  RunArguments run;
  std::filesystem::path library;
  std::optional<std::string> tour;               // The visitor is led along this one of the library.
  bool narrate = false;                          // What visitors are told is spoken.
  bool glasses = false;                          // Content on black, for each eye.
  std::optional<std::filesystem::path> display;  // Calibration of the worn display.
  bool gaze = false;                             // Cards open for what visitors look at.
  std::optional<std::filesystem::path> log;      // Folder for the records of visits.
  std::optional<std::filesystem::path> kiosk;    // File with the code by which the kiosk is ended.
  std::string hub;  // Address of the hub that the library follows; empty for none.
  std::optional<std::filesystem::path> script;
};

struct EvaluateOptions {
  std::vector<std::string> sequences;  // Folders or sim:SCENE.
  std::filesystem::path output;
  std::vector<std::filesystem::path> calibrations;  // By sequence; missing ones are searched in its folder.
  Pace pace = Pace::kEager;
  EngineKind engine = EngineKind::kHybrid;
  // Assumes that pure rotations are about the camera centre, as hybrid-slam does: RotationCenter is disabled,
  // and the test for pure rotation has no residual limit of its own. For comparison.
  bool turn_about_camera = false;
  bool leave_loops_open = false;  // Disables loop closing. For comparison.
  WhenLost when_lost = WhenLost::kNew;
  bool compare = false;                  // Also runs the other engine.
  std::vector<std::size_t> dump_frames;  // Frame indices (rows of frames.csv, from 0) to dump in full.
  std::uint64_t seed = 1;  // Seed of the first run's engine, and of the simulated world in every run.
  std::size_t seeds = 1;   // Number of engine seeds: seed, seed + 1, ...; at least 1.
  std::size_t starts = 1;  // Number of windows over each sequence, at least 1; see RunsOf.
  Timestamp window{};      // Maximum duration of a run; 0: to the end of the sequence.
  double truth_noise_m =
      0.01;              // Noise of the ground truth of recorded sequences; see FalseInitializationOptions.
  std::size_t jobs = 1;  // Number of parallel runs, one thread each; above 1 only with lockstep.

  bool many_runs() const { return seeds > 1 || starts > 1; }
};

struct DemoOptions {
  bool headless = false;
  std::optional<std::filesystem::path> output, record;
  std::uint64_t seed = 1;
  Occlusion occlusion = Occlusion::kMap;  // As RunArguments.
  bool room_light = true;                 // As RunArguments.
};

struct CalibrateOptions {
  std::string source;  // Empty: only print the board.
  std::filesystem::path output;
  std::string board = "charuco:8x6:30";
  std::optional<engine::LensModel> lens;  // Empty: the model with the smallest cross-validated error.
  CameraOptions camera;
  std::optional<std::filesystem::path> print;
  bool headless = false;
};

// Returns the requested pace, or the default: realtime for devices and windows, eager for headless files.
Pace ResolvePace(const RunArguments& run, bool any_live);

}  // namespace docent::app
