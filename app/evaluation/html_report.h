// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/evaluation/evaluated_run.h"

namespace docent::app {

// report.html: one page for people with its plots inside; it loads nothing from anywhere. Runs
// that are compared stand side by side.
std::string FormatHtmlReport(const std::vector<EvaluatedRun>& runs);
void WriteHtmlReport(const std::filesystem::path& path, const std::vector<EvaluatedRun>& runs);

}  // namespace docent::app
