// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"
#include "app/evaluation/false_initialization.h"

// Distribution of the results of a sequence over many seeds and first frames. A user experiences a single run
// and not the mean, so the extremes and the worst run are reported together with the median.
namespace docent::app {

// Identifies a run: a seed of the engine and a window of the sequence.
struct RunKey {
  std::uint64_t seed = 1;
  std::size_t start = 0;        // Index of the window, from 0.
  std::size_t first_frame = 0;  // Index of the window's first frame in the sequence.
};

// Figures of one run; unknown figures are empty. It is small, so that many can be kept.
struct RunRow {
  RunKey key;
  int frames = 0, tracked = 0;
  double tracked_share = 0;  // Frames tracked in kept maps over all frames of the window.
  int compared_frames = 0;   // Tracked frames with a true pose.
  // RMS errors over the frames of all kept maps, each by the alignment of its own map; empty if fewer than
  // kMinComparedFrames of them have a true pose.
  std::optional<double> ate_m, rotation_deg;
  // Time from the window's first frame to the first pose in a kept map with finite points.
  std::optional<double> first_3d_pose_s;
  int maps = 0;  // Kept maps with at least one frame.
  int discarded_maps = 0;
  // Number of false initializations, and of those the engine noticed, because it discarded their maps. Empty
  // without truth, and if it decides on no initialization of those that there are.
  std::optional<int> false_starts, noticed;
  double tracking_median_ms = 0;
  std::vector<InitializationResult> initializations;
};
// starts: the result of ClassifyInitializations; empty without truth.
RunRow MakeRunRow(const RunKey& key, const RunRecord& run, const SequenceReport& report,
                  std::optional<std::vector<InitializationResult>> starts);

// A figure that is reported for every row.
struct Figure {
  const char* name;   // Name in report.json.
  const char* title;  // Name in tables and plots.
  const char* unit;   // Unit of the displayed value.
  double factor;      // From the row's unit to the displayed unit.
  int decimals;       // Decimals displayed.
  bool more_is_better;
  std::optional<double> (*value)(const RunRow& row);
};
std::span<const Figure> Figures();

// Spread over the runs that have the figure. The median of an even number of values is the mean of the two
// middle ones.
struct Spread {
  int runs = 0;
  double min = 0, median = 0, max = 0;
  std::size_t worst = 0;  // Index of the worst row; the first of equal ones.
};
std::optional<Spread> SpreadOf(const Figure& figure, const std::vector<RunRow>& rows);

// All runs of one sequence with one engine.
struct RunDistribution {
  std::string name, engine;  // As in RunRecord.
  std::size_t seeds = 1, starts = 1;
  double window_s = 0;  // 0: to the end of the sequence
  bool has_truth = false;
  std::vector<RunRow> rows;  // Ordered by start, then seed.
};

// Index of the row with the smallest tracked share and, among equal ones, the largest ATE. The rows must not
// be empty.
std::size_t WorstRun(const std::vector<RunRow>& rows);

// "seed 3" or "seed 3, start 2".
std::string NameOf(const RunKey& key, const RunDistribution& of);
// Formats the value with its unit; "-" when it is empty.
std::string FormatValue(const Figure& figure, const std::optional<double>& value);
// One line about a run for the terminal.
std::string FormatRunLine(const RunRow& row, const RunDistribution& of);
// A table with one line for each figure, for the terminal.
std::string FormatTable(const RunDistribution& distribution);

}  // namespace docent::app
