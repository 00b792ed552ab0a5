// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"

namespace docent::app {

// Everything that a report shows of one sequence.
struct EvaluatedRun {
  RunRecord run;
  std::vector<TimedPose> truth;      // may be empty
  std::vector<TimedLabel> segments;  // may be empty
  SequenceReport report;             // of this run
};

// report.html: one page for people with its plots inside; it loads nothing from anywhere.
std::string FormatHtmlReport(const std::vector<EvaluatedRun>& runs);
void WriteHtmlReport(const std::filesystem::path& path, const std::vector<EvaluatedRun>& runs);

}  // namespace docent::app
