// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "app/command_line/options.h"

namespace CLI {
class App;
}

// Frame of the program: registers the subcommands and reports their errors. Each subcommand is one function
// in its own file, which adds the subcommand to the parser. When the command line selects that subcommand,
// its callback sets `Invocation::run`.
namespace docent::app {

struct Invocation {
  Verbosity verbosity = Verbosity::kNormal;
  std::function<void()> run;  // Set by the selected subcommand; throws docent::Error.
};

// Parses the command line and runs the selected subcommand. Returns the exit status: 0 for success, 1 for a
// failure while running, 2 for a wrong argument. Both failures print one line on standard error.
int RunProgram(int argc, const char* const* argv);

// Adds a subcommand whose help ends with an example. Global options may follow the subcommand.
CLI::App* AddSubcommand(CLI::App* parent, const std::string& name, const std::string& description,
                        const std::string& example);

void AddCamerasCommand(CLI::App* program, Invocation* invocation);
void AddSimulateCommand(CLI::App* program, Invocation* invocation);
void AddTrainVocabularyCommand(CLI::App* program, Invocation* invocation);
void AddMapsCommand(CLI::App* program, Invocation* invocation);
void AddContentCommand(CLI::App* program, Invocation* invocation);

// These receive the function that executes the subcommand, so that tests can replace it.
void AddAuthorCommand(CLI::App* program, Invocation* invocation,
                      std::function<void(const AuthorOptions&, Verbosity)> run);
void AddTourCommand(CLI::App* program, Invocation* invocation,
                    std::function<void(const TourOptions&, Verbosity)> run);
void AddEvaluateCommand(CLI::App* program, Invocation* invocation,
                        std::function<void(const EvaluateOptions&, Verbosity)> run);
void AddCalibrateCommand(CLI::App* program, Invocation* invocation,
                         std::function<void(const CalibrateOptions&, Verbosity)> run);
void AddDemoCommand(CLI::App* program, Invocation* invocation,
                    std::function<void(const DemoOptions&, Verbosity)> run);

}  // namespace docent::app
