// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/program.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <opencv2/core.hpp>

#include "app/cameras/frame_source.h"
#include "app/command_line/hub_command.h"
#include "app/command_line/runs.h"
#include "docent/version.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

int ReportError(const std::string& message, ExitStatus exit_status) {
  std::fprintf(stderr, "docent: %s\n", OneLine(message).c_str());
  return exit_status;
}

// Full name of the selected subcommand with its parents, for instance "docent maps list".
std::string SelectedCommand(const CLI::App& program) {
  std::string name = "docent";
  for (const CLI::App* app = &program; !app->get_subcommands().empty();) {
    app = app->get_subcommands().front();
    name += ' ' + app->get_name();
  }
  return name;
}

// Describes a parse error. An unknown argument is reported before a missing one, because the missing one is
// usually a misspelled argument.
std::string Diagnose(const CLI::App& program, const CLI::ParseError& error) {
  const bool about_words = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr ||
                           dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  const std::vector<std::string> unknown = program.remaining(true);
  if (!about_words || unknown.empty()) return error.what();
  const std::string& word = unknown.front();
  if (word.starts_with('-')) return "There is no option '" + word + "'";
  const CLI::App* chosen = &program;
  while (!chosen->get_subcommands().empty()) chosen = chosen->get_subcommands().front();
  if (chosen->get_require_subcommand_min() > 0) return "There is no subcommand '" + word + "'";
  return "Unexpected argument '" + word + "'";
}

void SetUpLog(Verbosity verbosity) {
  auto log = std::make_shared<spdlog::logger>("docent", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log->set_pattern("docent: %l: %v");
  log->set_level(verbosity == Verbosity::kQuiet     ? spdlog::level::err
                 : verbosity == Verbosity::kVerbose ? spdlog::level::debug
                                                    : spdlog::level::warn);
  spdlog::set_default_logger(std::move(log));
}

int RunGuarded(const std::function<void()>& run) {
  try {
    run();
    // Output that cannot be written, for instance to a full disk, is a failure too.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return ReportError("Cannot write the standard output.", kFailed);
    return kDone;
  } catch (const Error& error) {
    return ReportError(error.what(), kFailed);
  } catch (const std::bad_alloc&) {
    return ReportError("There is not enough memory.", kFailed);
  } catch (const cv::Exception& error) {
    return ReportError("An image operation failed: " + error.err + " (" + error.func + ").", kFailed);
  } catch (const std::filesystem::filesystem_error& error) {
    return ReportError("'" + error.path1().string() + "' cannot be used: " + error.code().message() + ".",
                       kFailed);
  } catch (const std::exception& error) {
    return ReportError(std::string("Internal error: ") + error.what() + ".", kFailed);
  }
}

// The end of the help: an example and the table of exit statuses.
std::string ProgramFooter() {
  std::string text =
      "Example:\n  docent simulate room --output room\nEvery subcommand has its own --help.\n\nExit status:";
  for (const auto& [status, meaning] : kExitStatusMeanings)
    text += "\n  " + std::to_string(status) + "  " + meaning;
  return text;
}

}  // namespace

std::string OneLine(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const bool blank = c == '\n' || c == '\r' || c == ' ';
    if (blank && (line.empty() || line.back() == ' ')) continue;
    line += blank ? ' ' : c;
  }
  while (line.ends_with(' ')) line.pop_back();
  if (line.ends_with("..") && !line.ends_with("...")) line.pop_back();
  return line;
}

CLI::App* AddSubcommand(CLI::App* parent, const std::string& name, const std::string& description,
                        const std::string& example) {
  CLI::App* command = parent->add_subcommand(name, description);
  command->fallthrough();
  command->footer("Example:\n  " + example);
  return command;
}

int RunProgram(int argc, const char* const* argv) {
  CLI::App program(
      "Docent, an augmented-reality guide: it builds maps, recognizes them later, and shows what was "
      "placed in them.",
      "docent");
  program.footer(ProgramFooter());
  program.require_subcommand(1);
  program.set_version_flag("--version", std::string("docent ") + kVersion, "Print the version and exit");
  Invocation invocation;
  bool quiet = false, verbose = false;
  CLI::Option* quiet_option = program.add_flag("--quiet", quiet, "Print only errors");
  program.add_flag("--verbose", verbose, "Print more detail")->excludes(quiet_option);

  AddCamerasCommand(&program, &invocation);
  AddCalibrateCommand(&program, &invocation, RunCalibrate);
  AddSimulateCommand(&program, &invocation);
  AddTrainVocabularyCommand(&program, &invocation);
  AddMapsCommand(&program, &invocation);
  AddHubCommand(&program, &invocation);
  AddContentCommand(&program, &invocation);
  AddDemoCommand(&program, &invocation, RunDemo);
  AddAuthorCommand(&program, &invocation, RunAuthor);
  AddTourCommand(&program, &invocation, RunTour);
  AddReportCommand(&program, &invocation);
  AddEvaluateCommand(&program, &invocation, RunEvaluate);

  QuietDecoders();
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);  // --help and --version
    const std::string command = SelectedCommand(program);
    return ReportError(Diagnose(program, error) + " (see " + command + " --help)", kWrongArgument);
  }
  invocation.verbosity = quiet ? Verbosity::kQuiet : verbose ? Verbosity::kVerbose : Verbosity::kNormal;
  SetUpLog(invocation.verbosity);
  if (!invocation.hub_library) return RunGuarded(invocation.run);
  return RunGuarded([&] { RunWithHubLibrary(*invocation.hub_library, invocation.run); });
}

}  // namespace docent::app
