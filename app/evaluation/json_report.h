// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"
#include "app/evaluation/run_distribution.h"

namespace docent::app {

// report.json: one object a sequence under `sequences`, with the fields of command-line.md and, beyond them,
// `engine`, `last_tracked_frame`, `discarded_frames`, `directions_only_frames`, `turn_error_deg`, `maps` and
// `segments`. What is not known is null. `compared`: the same sequences by the other engine, under a field of
// that name; left out when empty.
std::string FormatJsonReport(const std::vector<SequenceReport>& reports,
                             const std::vector<SequenceReport>& compared = {});
// The same of many runs: one object a sequence with `name`, `engine` and `distribution`, which holds the
// number of seeds and starts, minimum, median, maximum and worst run of each figure, and one object for each
// run.
std::string FormatJsonReport(const std::vector<RunDistribution>& distributions,
                             const std::vector<RunDistribution>& compared);
void WriteJsonReport(const std::filesystem::path& path, const std::vector<SequenceReport>& reports,
                     const std::vector<SequenceReport>& compared = {});
void WriteJsonReport(const std::filesystem::path& path, const std::vector<RunDistribution>& distributions,
                     const std::vector<RunDistribution>& compared);

// One line a sequence for the terminal, such as "kitchen: 97.2 % tracked, ATE 5.1 cm, 4.0 ms a frame".
std::string FormatSummary(const SequenceReport& report);

}  // namespace docent::app
