// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"
#include "app/evaluation/false_start.h"

// What a sequence gives over many seeds and starting frames: the lottery as figures. A wearer has one run
// and not the mean, so the extremes are told beside the median, and who had them.
namespace docent::app {

// One of the runs: a seed of the engine and a window of the sequence.
struct RunKey {
  std::uint64_t seed = 1;
  std::size_t start = 0;        // number of the window, from 0
  std::size_t first_frame = 0;  // of the sequence
};

// The figures of one run; empty where there is nothing to tell. Small, so that any number can be kept.
struct RunRow {
  RunKey key;
  int frames = 0, tracked = 0;
  double tracked_share = 0;  // of all frames of the window, in maps that were kept
  // Over the frames of all kept maps, each by the alignment of its own map; empty without a truth.
  std::optional<double> ate_m, rotation_deg;
  // From the window's first frame to the first one with a pose in a kept map that has depth.
  std::optional<double> first_3d_pose_s;
  int maps = 0;  // that were kept and had a frame
  int discarded_maps = 0;
  // Empty without a truth. Of the false starts, the noticed ones are in maps that the engine discarded.
  std::optional<int> false_starts, noticed;
  double tracking_median_ms = 0;
  std::vector<StartResult> starts;
};
// starts: as JudgeStarts tells them; empty without a truth.
RunRow MakeRunRow(const RunKey& key, const RunRecord& run, const SequenceReport& report,
                  std::optional<std::vector<StartResult>> starts);

// A figure of every row.
struct Figure {
  const char* name;   // as in report.json
  const char* title;  // for people
  const char* unit;   // of the values as they are shown
  double factor;      // from the row's unit to the shown one
  int decimals;       // that are shown
  bool more_is_better;
  std::optional<double> (*value)(const RunRow& row);
};
std::span<const Figure> Figures();

// Of the runs that have the figure; the median of an even number is the mean of the two in the middle.
struct Spread {
  int runs = 0;
  double min = 0, median = 0, max = 0;
  std::size_t worst = 0;  // index of the row, the first one of several that are alike
};
std::optional<Spread> SpreadOf(const Figure& figure, const std::vector<RunRow>& rows);

// All runs of one sequence by one engine.
struct RunDistribution {
  std::string name, engine;  // as in RunRecord
  std::size_t seeds = 1, starts = 1;
  double window_s = 0;  // 0: to the end of the sequence
  bool has_truth = false;
  std::vector<RunRow> rows;  // by start, then seed
};

// The row of the smallest tracked share, and among these of the largest error; the rows must not be empty.
std::size_t WorstRun(const std::vector<RunRow>& rows);

// "seed 3" or "seed 3, start 2".
std::string NameOf(const RunKey& key, const RunDistribution& of);
// The value as people read it, with its unit; "-" where there is none.
std::string Shown(const Figure& figure, const std::optional<double>& value);
// One line for the run that has just ended.
std::string FormatRunLine(const RunRow& row, const RunDistribution& of);
// A table with one line for each figure, for the terminal.
std::string FormatTable(const RunDistribution& distribution);

}  // namespace docent::app
