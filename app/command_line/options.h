// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/cameras/frame_source.h"
#include "app/session/head_control.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"

// What the person asked for, as plain structs: the command line is parsed into these early, and nothing
// behind them knows of words and dashes.
namespace docent::app {

enum class Verbosity { kQuiet, kNormal, kVerbose };

enum class Pace {
  kLockstep,  // tracker and mapper in turn on one thread: equal to the byte between runs
  kEager,     // threaded, drops nothing
  kRealtime,  // by the images' own times; drops those that come too late
};
enum class EngineKind {
  kHybrid,  // with panorama maps
  kSixDof,  // plain PTAM
};
// What a camera does that is lost where no map explains what it sees.
enum class WhenLost {
  kNew,   // it begins a new map after a moment, and goes on
  kWait,  // it waits until it sees a map again
};
const char* ToString(Pace pace);
const char* ToString(EngineKind engine);

struct CameraArguments {
  std::vector<std::string> sources;                 // one or two
  std::vector<std::filesystem::path> calibrations;  // for the first sources; the others' are found
  CameraOptions options;                            // device format; `seed` is RunArguments::seed
  Timestamp from{}, until{};                        // part of the source, from its first image; 0: no bound
};

// What every subcommand that tracks takes.
struct RunArguments {
  CameraArguments cameras;
  std::optional<Pace> pace;  // empty: see ResolvePace
  EngineKind engine = EngineKind::kHybrid;
  bool headless = false;
  std::optional<std::filesystem::path> output;  // folder
  std::optional<std::filesystem::path> record;  // video of the augmented view
  std::uint64_t seed = 1;
  std::size_t memory_budget_bytes = std::size_t{1} << 30;  // of maps in memory
  std::optional<HeadPolicy> head;                          // of cameras that can turn their heads
  double baseline_m = 0;                                   // measured between the two cameras; 0: not
};

struct AuthorOptions {
  RunArguments run;
  std::filesystem::path library;
  std::optional<std::filesystem::path> target;  // a printed image that new maps start from
  double target_width_m = 0;
  std::optional<std::filesystem::path> script, record_script;
  Timestamp autosave_interval = std::chrono::seconds(10);  // 0: at each change of map alone
  std::optional<WhenLost> when_lost;                       // empty: kWait where a window can ask, else kNew
};

struct TourOptions {
  RunArguments run;
  std::filesystem::path library;
};

struct EvaluateOptions {
  std::vector<std::string> sequences;  // folders or sim:SCENE
  std::filesystem::path output;
  std::vector<std::filesystem::path> calibrations;  // for the first sequences; the others' are found
  Pace pace = Pace::kEager;
  EngineKind engine = EngineKind::kHybrid;
  bool turn_about_camera =
      false;  // as in hybrid-slam: no RotationCenter, and no question whether it is a turn
  bool leave_loops_open = false;
  WhenLost when_lost = WhenLost::kNew;
  bool compare = false;                  // run the other engine too
  std::vector<std::size_t> dump_frames;  // lines of frames.csv, from 0, about which everything is written
  std::uint64_t seed = 1;                // of the first run's engine, and of every run's simulated world
  std::size_t seeds = 1;                 // runs with seed, seed + 1, ... of the engine, at least 1
  std::size_t starts = 1;                // windows over each sequence, at least 1, see RunsOf
  Timestamp window{};                    // the most that each run may last; 0: to the end of the sequence
  double truth_noise_m = 0.01;           // of recorded sequences, see FalseStartOptions
  std::size_t jobs = 1;                  // runs side by side, each on a thread of its own; lockstep alone

  bool many_runs() const { return seeds > 1 || starts > 1; }
};

struct DemoOptions {
  bool headless = false;
  std::optional<std::filesystem::path> output, record;
  std::uint64_t seed = 1;
};

struct CalibrateOptions {
  std::string source;  // empty: only print the board
  std::filesystem::path output;
  std::string board = "charuco:8x6:30";
  std::optional<engine::LensModel> lens;  // empty: whichever predicts best
  CameraOptions camera;
  std::optional<std::filesystem::path> print;
  bool headless = false;
};

// The pace that was asked for, or else realtime for devices and windows and eager for headless files.
Pace ResolvePace(const RunArguments& run, bool any_live);

}  // namespace docent::app
