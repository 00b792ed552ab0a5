// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/run_distribution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace docent::app {

namespace {

std::optional<double> AsNumber(const std::optional<int>& value) {
  return value ? std::optional<double>(*value) : std::nullopt;
}

constexpr std::array<Figure, 8> kFigures = {{
    {"tracked_share", "tracked frames", " %", 100, 1, true,
     [](const RunRow& row) { return std::optional(row.tracked_share); }},
    {"ate_rmse_m", "ATE", " cm", 100, 2, false, [](const RunRow& row) { return row.ate_m; }},
    {"rotation_rmse_deg", "rotation error", " deg", 1, 2, false,
     [](const RunRow& row) { return row.rotation_deg; }},
    {"first_3d_pose_s", "first 3D pose after", " s", 1, 2, false,
     [](const RunRow& row) { return row.first_3d_pose_s; }},
    {"false_starts", "false initializations", "", 1, 0, false,
     [](const RunRow& row) { return AsNumber(row.false_starts); }},
    {"unnoticed_false_starts", "unnoticed of these", "", 1, 0, false,
     [](const RunRow& row) {
       return row.false_starts ? std::optional<double>(*row.false_starts - row.noticed.value_or(0))
                               : std::nullopt;
     }},
    {"maps", "maps", "", 1, 0, false, [](const RunRow& row) { return std::optional<double>(row.maps); }},
    {"discarded_maps", "discarded maps", "", 1, 0, false,
     [](const RunRow& row) { return std::optional<double>(row.discarded_maps); }},
}};

// Root mean square of the values that are known; empty if they are too few.
std::optional<double> RootMeanSquare(const std::vector<FrameResult>& frames,
                                     std::optional<double> FrameResult::*value) {
  double sum = 0;
  std::size_t count = 0;
  for (const FrameResult& frame : frames) {
    if (!(frame.*value)) continue;
    sum += *(frame.*value) * *(frame.*value);
    ++count;
  }
  return count >= kMinComparedFrames ? std::optional(std::sqrt(sum / static_cast<double>(count)))
                                     : std::nullopt;
}

std::string Padded(const std::string& text, std::size_t width, bool left = false) {
  const std::string blanks(text.size() < width ? width - text.size() : 0, ' ');
  return left ? text + blanks : blanks + text;
}

std::string Plural(std::size_t count, const std::string& word) {
  return std::to_string(count) + " " + word + (count == 1 ? "" : "s");
}

std::string FalseInitializationLine(const RunDistribution& distribution) {
  if (!distribution.has_truth) return "false initializations: unknown without ground truth\n";
  int runs = 0, all = 0, noticed = 0, undecided = 0;
  for (const RunRow& row : distribution.rows) {
    runs += row.false_starts.value_or(0) > 0;
    all += row.false_starts.value_or(0);
    noticed += row.noticed.value_or(0);
    for (const InitializationResult& start : row.initializations)
      undecided += start.outcome == InitializationOutcome::kUndecided;
  }
  return "false initializations in " + std::to_string(runs) + " of " +
         Plural(distribution.rows.size(), "run") + ": " + std::to_string(all) + " in total, " +
         std::to_string(noticed) + " of them noticed; " + std::to_string(undecided) + " undecided\n";
}

}  // namespace

RunRow MakeRunRow(const RunKey& key, const RunRecord& run, const SequenceReport& report,
                  std::optional<std::vector<InitializationResult>> starts) {
  RunRow row;
  row.key = key;
  row.frames = report.frames;
  row.tracked = report.tracked;
  row.tracked_share = report.frames > 0 ? static_cast<double>(report.tracked) / report.frames : 0;
  row.compared_frames = report.compared_frames;
  row.ate_m = RootMeanSquare(report.frame_results, &FrameResult::position_error_m);
  row.rotation_deg = RootMeanSquare(report.frame_results, &FrameResult::rotation_error_deg);
  for (std::size_t i = 0; i < report.frame_results.size() && !row.first_3d_pose_s; ++i) {
    if (report.frame_results[i].has_position)
      row.first_3d_pose_s = ToSeconds(run.frames[i].time - run.frames.front().time);
  }
  for (const MapResult& map : report.maps) {
    row.maps += !map.discarded && map.joined_into.empty() && map.frames > 0;
    row.discarded_maps += map.discarded;
  }
  row.tracking_median_ms = report.tracking_median_ms;
  if (!starts) return row;
  const bool decided =
      starts->empty() || std::any_of(starts->begin(), starts->end(), [](const InitializationResult& start) {
        return start.outcome != InitializationOutcome::kUndecided;
      });
  if (decided) {
    row.false_starts = row.noticed = 0;
    for (const InitializationResult& start : *starts) {
      if (!IsFalse(start.outcome)) continue;
      ++*row.false_starts;
      *row.noticed += start.discarded;
    }
  }
  row.initializations = std::move(*starts);
  return row;
}

std::span<const Figure> Figures() {
  return kFigures;
}

std::optional<Spread> SpreadOf(const Figure& figure, const std::vector<RunRow>& rows) {
  std::vector<double> values;
  Spread spread;
  double worst = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::optional<double> value = figure.value(rows[i]);
    if (!value) continue;
    if (values.empty() || (figure.more_is_better ? *value < worst : *value > worst)) {
      worst = *value;
      spread.worst = i;
    }
    values.push_back(*value);
  }
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  spread.runs = static_cast<int>(values.size());
  spread.min = values.front();
  spread.median = values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
  spread.max = values.back();
  return spread;
}

std::size_t WorstRun(const std::vector<RunRow>& rows) {
  const auto worse = [](const RunRow& a, const RunRow& b) {
    if (a.tracked_share != b.tracked_share) return a.tracked_share < b.tracked_share;
    return a.ate_m.value_or(0) > b.ate_m.value_or(0);
  };
  return static_cast<std::size_t>(std::min_element(rows.begin(), rows.end(), worse) - rows.begin());
}

std::string NameOf(const RunKey& key, const RunDistribution& of) {
  const std::string seed = "seed " + std::to_string(key.seed);
  return of.starts > 1 ? seed + ", start " + std::to_string(key.start) : seed;
}

std::string FormatValue(const Figure& figure, const std::optional<double>& value) {
  if (!value) return "-";
  // The median of counts may not be an integer.
  const double shown = *value * figure.factor;
  const int decimals = figure.decimals == 0 && shown != std::round(shown) ? 1 : figure.decimals;
  char text[64];
  std::snprintf(text, sizeof text, "%.*f%s", decimals, shown, figure.unit);
  return text;
}

std::string FormatRunLine(const RunRow& row, const RunDistribution& of) {
  std::string text = of.name + ", " + NameOf(row.key, of) + ": ";
  bool first = true;
  for (const Figure& figure : kFigures) {
    const std::optional<double> value = figure.value(row);
    if (!value && !of.has_truth) continue;
    text += (first ? "" : ", ") + std::string(figure.title) + " " + FormatValue(figure, value);
    first = false;
  }
  return text;
}

std::string FormatTable(const RunDistribution& distribution) {
  std::string text = distribution.name;
  if (!distribution.engine.empty()) text += ", " + distribution.engine;
  text += ": " + Plural(distribution.rows.size(), "run") + " (" + Plural(distribution.seeds, "seed") + ", " +
          Plural(distribution.starts, "start");
  char window[64];
  std::snprintf(window, sizeof window, ", %g s each", distribution.window_s);
  text += (distribution.window_s > 0 ? window : "") + std::string(")\n");
  constexpr std::size_t kName = 22, kValue = 11;
  text += Padded("", kName, true) + Padded("min", kValue) + Padded("median", kValue) + Padded("max", kValue) +
          Padded("runs", 6) + "  worst\n";
  for (const Figure& figure : kFigures) {
    text += Padded(figure.title, kName, true);
    const std::optional<Spread> spread = SpreadOf(figure, distribution.rows);
    if (!spread) {
      text += Padded("-", kValue) + Padded("-", kValue) + Padded("-", kValue) + Padded("0", 6) + "\n";
      continue;
    }
    for (const double value : {spread->min, spread->median, spread->max})
      text += Padded(FormatValue(figure, value), kValue);
    const bool alike = spread->min == spread->max;
    text += Padded(std::to_string(spread->runs), 6) + "  " +
            (alike ? "all equal" : NameOf(distribution.rows[spread->worst].key, distribution)) + "\n";
  }
  text += FalseInitializationLine(distribution);
  if (!distribution.rows.empty())
    text +=
        "worst run: " + FormatRunLine(distribution.rows[WorstRun(distribution.rows)], distribution) + "\n";
  return text;
}

}  // namespace docent::app
