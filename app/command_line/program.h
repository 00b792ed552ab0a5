// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "app/command_line/hub_library.h"
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
  std::function<void()> run;              // Set by the selected subcommand; throws docent::Error.
  std::optional<HubLibrary> hub_library;  // The library, when it is given by the address of a hub.
};

// What the exit status of the program means; docs/guide.md has the same table.
enum ExitStatus : int { kDone = 0, kFailed = 1, kWrongArgument = 2 };
struct ExitStatusMeaning {
  ExitStatus status;
  const char* meaning;
};
inline constexpr ExitStatusMeaning kExitStatusMeanings[] = {
    {kDone, "The command was carried out; a tour or an author's session may have been ended by Ctrl-C."},
    {kFailed, "The command failed or was interrupted; one line on standard error says why."},
    {kWrongArgument, "The command line is wrong, and nothing was done; one line on standard error says why."},
};

// A message as it is printed: without line breaks and repeated spaces, because every error is reported on one
// line, and with one full stop where a sentence that ends with one was quoted at the end of another. Three
// stay an ellipsis.
std::string OneLine(std::string_view text);

// Parses the command line and runs the selected subcommand. Returns the exit status. Both failures print one
// line on standard error.
int RunProgram(int argc, const char* const* argv);

// Adds a subcommand whose help ends with an example. Global options may follow the subcommand.
CLI::App* AddSubcommand(CLI::App* parent, const std::string& name, const std::string& description,
                        const std::string& example);

void AddCamerasCommand(CLI::App* program, Invocation* invocation);
void AddSimulateCommand(CLI::App* program, Invocation* invocation);
void AddTrainVocabularyCommand(CLI::App* program, Invocation* invocation);
void AddMapsCommand(CLI::App* program, Invocation* invocation);
void AddContentCommand(CLI::App* program, Invocation* invocation);
void AddReportCommand(CLI::App* program, Invocation* invocation);

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
