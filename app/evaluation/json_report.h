// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"
#include "app/evaluation/run_distribution.h"

namespace docent::app {

// Formats report.json: one object for each sequence under `sequences`, with the fields that
// docs/output-files.md describes. Unknown values are null. `compared` holds the same sequences with
// the other engine, in a field of that name; the field is omitted when it is empty.
std::string FormatJsonReport(const std::vector<SequenceReport>& reports,
                             const std::vector<SequenceReport>& compared = {});
// Formats report.json for many runs: one object for each sequence with `name`, `engine` and `distribution`.
// The distribution has the number of seeds and starts; minimum, median, maximum and worst run of each figure;
// and one object for each run.
std::string FormatJsonReport(const std::vector<RunDistribution>& distributions,
                             const std::vector<RunDistribution>& compared);
void WriteJsonReport(const std::filesystem::path& path, const std::vector<SequenceReport>& reports,
                     const std::vector<SequenceReport>& compared = {});
void WriteJsonReport(const std::filesystem::path& path, const std::vector<RunDistribution>& distributions,
                     const std::vector<RunDistribution>& compared);

// One line for each sequence for the terminal, such as "kitchen: 97.2 % tracked, ATE 5.1 cm, 4.0 ms per
// frame".
std::string FormatSummary(const SequenceReport& report);

}  // namespace docent::app
