// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "app/command_line/options.h"

namespace CLI {
class App;
}

// The program's frame: which subcommands there are, what happens to their faults, and how they tell the
// person. Each subcommand is one function in a file of its own that adds itself to the parser and, when its
// words are found on the command line, says in `Invocation::run` what to do.
namespace docent::app {

struct Invocation {
  Verbosity verbosity = Verbosity::kNormal;
  std::function<void()> run;  // set by the subcommand that was chosen; throws docent::Error
};

// Parses the command line and runs what it asks for. Answers with the exit status: 0, or 1 after a failure
// while running, or 2 after a wrong argument; either time with one line on standard error.
int RunProgram(int argc, const char* const* argv);

// A new subcommand with an example below its help; global options may stand behind it.
CLI::App* AddSubcommand(CLI::App* parent, const std::string& name, const std::string& description,
                        const std::string& example);

void AddCamerasCommand(CLI::App* program, Invocation* invocation);
void AddSimulateCommand(CLI::App* program, Invocation* invocation);
void AddTrainVocabularyCommand(CLI::App* program, Invocation* invocation);
void AddMapsCommand(CLI::App* program, Invocation* invocation);
void AddContentCommand(CLI::App* program, Invocation* invocation);

// These take what carries them out.
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
