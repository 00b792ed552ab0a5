// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/options.h"

// What the subcommands that track carry out. Each throws Error with one sentence when it cannot.
namespace docent::app {

// Throws Error when panorama maps are asked for, which this version does not make.

void RunEvaluate(const EvaluateOptions& options, Verbosity verbosity);
void RunAuthor(const AuthorOptions& options, Verbosity verbosity);
void RunTour(const TourOptions& options, Verbosity verbosity);
void RunCalibrate(const CalibrateOptions& options, Verbosity verbosity);
void RunDemo(const DemoOptions& options, Verbosity verbosity);

}  // namespace docent::app
