// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/options.h"
#include "app/evaluation/evaluated_run.h"
#include "app/evaluation/ground_truth.h"
#include "app/evaluation/run_distribution.h"
#include "app/session/calibrated_camera.h"
#include "app/simulator/simulation.h"

// One sequence of `docent evaluate`: opening it as often as it is run, and running it.
namespace docent::app {

// What is known of a sequence before it is run, and what all its runs share. Immutable once it is made; any
// thread.
struct EvaluatedSequence {
  std::string word;  // as it was given
  std::optional<std::filesystem::path> calibration;
  std::shared_ptr<const Simulation> simulation;  // of sim:SCENE; null otherwise
  std::string name;                              // as the source calls itself
  std::optional<std::uint64_t> frame_count;
  double frames_per_second = 30;
  std::vector<TimedPose> truth;      // may be empty
  std::vector<TimedLabel> segments;  // may be empty
};

// The sequence of that index in the options. Throws Error with one sentence where it cannot be opened, is a
// live camera, or has not enough frames for the windows that are asked for.
EvaluatedSequence KnowSequence(const EvaluateOptions& options, std::size_t index);

// Its images from the frame of that number on; see WindowOf. Throws Error.
CalibratedCamera OpenWindow(const EvaluatedSequence& sequence, std::uint64_t first_frame, Timestamp window);

// Judges the starts of a run of this sequence that began at that frame; empty without a truth. Throws Error.
std::optional<std::vector<StartResult>> JudgeStartsOf(const EvaluateOptions& options,
                                                      const EvaluatedSequence& sequence, const RunKey& key,
                                                      const RunRecord& run);

// The first frames of so many windows, evenly over a sequence of so many frames. Where a window of that
// length (0: to the end of the sequence) fits into the sequence so often, at a frame of its own each time,
// every window lies within it, so that all runs are equally long; otherwise later ones are shorter.
std::vector<std::uint64_t> FirstFrames(std::size_t starts, std::uint64_t frames, std::uint64_t window_frames);

// The runs that are asked for, by start, then seed.
std::vector<RunKey> RunsOf(const EvaluateOptions& options, const EvaluatedSequence& sequence);

// How one run is carried out.
struct TrackRequest {
  std::string name;              // of the sequence, for the record
  std::filesystem::path folder;  // of the run's files
  RunKey key;
  // Leaves out what only one run is worth: whole adjustments, panorama images, and their progress.
  bool one_of_many = false;
};

// Tracks the sequence in a fresh session and leaves its files in the folder. `panoramas` may be null with
// one_of_many. Throws Error; the files then hold what came before the fault.
RunRecord Track(const EvaluateOptions& options, const EvaluatedSequence& sequence,
                const TrackRequest& request, Verbosity verbosity, std::vector<ShownPanorama>* panoramas);

}  // namespace docent::app
