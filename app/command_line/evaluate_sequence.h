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
#include "app/session/session.h"
#include "app/simulator/simulation.h"

// One sequence of `docent evaluate`: how it is opened for each run, and how it is run.
namespace docent::app {

// Properties of a sequence that all its runs share. Immutable after construction; any thread.
struct EvaluatedSequence {
  std::string word;  // As given on the command line.
  std::optional<std::filesystem::path> calibration;
  std::shared_ptr<const Simulation> simulation;  // For sim:SCENE; null otherwise.
  std::string name;                              // SourceInfo::name.
  std::optional<std::uint64_t> frame_count;
  double frames_per_second = 30;
  std::vector<TimedPose> truth;      // Ground truth; may be empty.
  std::vector<TimedLabel> segments;  // Labelled time intervals; may be empty.
};

// Opens the sequence with this index in the options and reads its properties and ground truth. Throws Error
// with one sentence when it cannot be opened, is a live camera, or has too few frames for the requested
// windows.
EvaluatedSequence DescribeSequence(const EvaluateOptions& options, std::size_t index);

// Opens the sequence from frame `first_frame` on; see WindowOf. Throws Error.
CalibratedCamera OpenWindow(const EvaluatedSequence& sequence, std::uint64_t first_frame, Timestamp window);

// Classifies the map initializations of a run as correct or false (see ClassifyInitializations). `key` gives
// the run's first frame. True depths are measured with the run's estimate of the lens where it has one. Empty
// without ground truth. Throws Error.
std::optional<std::vector<InitializationResult>> ClassifyInitializationsOf(const EvaluateOptions& options,
                                                                           const EvaluatedSequence& sequence,
                                                                           const RunKey& key,
                                                                           const RunRecord& run);

// First frames of `starts` windows, spaced evenly over a sequence of `frames` frames. If `starts` windows of
// `window_frames` (0: to the end of the sequence) fit, each beginning at a different frame, all of them lie
// within the sequence and have the same length; otherwise later windows are shorter.
std::vector<std::uint64_t> FirstFrames(std::size_t starts, std::uint64_t frames, std::uint64_t window_frames);

// The record of one of a session's maps, which must have a snapshot. `maps`: all of them.
MapRecord RecordOfMap(const Session::MapState& map, const std::vector<Session::MapState>& maps);

// The requested runs, ordered by start, then seed.
std::vector<RunKey> RunsOf(const EvaluateOptions& options, const EvaluatedSequence& sequence);

// Throws Error if the folder for the files of a run is a recording that is evaluated, or lies in one: the
// files would replace its images, or be taken for them the next time.
void CheckRunFolder(const EvaluateOptions& options, const std::filesystem::path& folder);

// Parameters of one run.
struct TrackRequest {
  std::string name;              // Name of the sequence in the record.
  std::filesystem::path folder;  // Folder for the run's files.
  RunKey key;
  // Skips the final global bundle adjustments, the panorama images and the progress line, to save time.
  bool one_of_many = false;
};

// Tracks the sequence in a new session and writes its files into the folder. `panoramas` may be null with
// one_of_many. Throws Error; the files then hold the frames and events up to the failure.
RunRecord Track(const EvaluateOptions& options, const EvaluatedSequence& sequence,
                const TrackRequest& request, Verbosity verbosity, std::vector<ShownPanorama>* panoramas);

}  // namespace docent::app
