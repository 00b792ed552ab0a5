// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/options.h"

// Implementations of the subcommands that process camera images. Each throws Error with one sentence on
// failure.
namespace docent::app {

void RunEvaluate(const EvaluateOptions& options, Verbosity verbosity);
void RunAuthor(const AuthorOptions& options, Verbosity verbosity);
void RunTour(const TourOptions& options, Verbosity verbosity);
void RunCalibrate(const CalibrateOptions& options, Verbosity verbosity);
void RunDemo(const DemoOptions& options, Verbosity verbosity);

}  // namespace docent::app
