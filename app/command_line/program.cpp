// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/program.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <opencv2/core.hpp>

#include "app/cameras/frame_source.h"
#include "app/command_line/runs.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// One line, whatever the message was made of.
std::string OneLine(std::string text) {
  std::string line;
  for (const char c : text) {
    const bool blank = c == '\n' || c == '\r' || c == ' ';
    if (blank && (line.empty() || line.back() == ' ')) continue;
    line += blank ? ' ' : c;
  }
  while (line.ends_with(' ')) line.pop_back();
  return line;
}

int Complain(const std::string& message, int exit_status) {
  std::fprintf(stderr, "docent: %s\n", OneLine(message).c_str());
  return exit_status;
}

// The subcommand that the words have led to, with its parents: "docent maps list".
std::string ChosenCommand(const CLI::App& program) {
  std::string name = "docent";
  for (const CLI::App* app = &program; !app->get_subcommands().empty();) {
    app = app->get_subcommands().front();
    name += ' ' + app->get_name();
  }
  return name;
}

// What is wrong with the words. A word that nobody knows is named before anything that it may have been meant
// for is said to be missing.
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
  return "The word '" + word + "' is too much";
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
    // Output that does not reach its reader (a full disk behind a redirection) is a failure too.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return Complain("Cannot write the standard output.", 1);
    return 0;
  } catch (const Error& error) {
    return Complain(error.what(), 1);
  } catch (const std::bad_alloc&) {
    return Complain("There is not enough memory.", 1);
  } catch (const cv::Exception& error) {
    return Complain("An image operation failed: " + error.err + " (" + error.func + ").", 1);
  } catch (const std::exception& error) {
    return Complain(std::string("Something failed that should not: ") + error.what() + ".", 1);
  }
}

}  // namespace

CLI::App* AddSubcommand(CLI::App* parent, const std::string& name, const std::string& description,
                        const std::string& example) {
  CLI::App* command = parent->add_subcommand(name, description);
  command->fallthrough();
  command->footer("Example:\n  " + example);
  return command;
}

int RunProgram(int argc, const char* const* argv) {
  CLI::App program(
      "Docent, an augmented-reality guide: it builds maps, remembers them, and shows what stands in them.",
      "docent");
  program.footer("Example:\n  docent simulate room --output room\nEvery subcommand has --help.");
  program.require_subcommand(1);
  program.set_version_flag("--version", "docent 0.1.0", "Print the version and exit");
  Invocation invocation;
  bool quiet = false, verbose = false;
  CLI::Option* quiet_option = program.add_flag("--quiet", quiet, "Say nothing but errors");
  program.add_flag("--verbose", verbose, "Say more about what is done")->excludes(quiet_option);

  AddCamerasCommand(&program, &invocation);
  AddCalibrateCommand(&program, &invocation, RunCalibrate);
  AddSimulateCommand(&program, &invocation);
  AddTrainVocabularyCommand(&program, &invocation);
  AddMapsCommand(&program, &invocation);
  AddContentCommand(&program, &invocation);
  AddDemoCommand(&program, &invocation, RunDemo);
  AddAuthorCommand(&program, &invocation, RunAuthor);
  AddTourCommand(&program, &invocation, RunTour);
  AddEvaluateCommand(&program, &invocation, RunEvaluate);

  QuietDecoders();
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);  // --help and --version
    const std::string command = ChosenCommand(program);
    return Complain(Diagnose(program, error) + " (see " + command + " --help)", 2);
  }
  invocation.verbosity = quiet ? Verbosity::kQuiet : verbose ? Verbosity::kVerbose : Verbosity::kNormal;
  SetUpLog(invocation.verbosity);
  return RunGuarded(invocation.run);
}

}  // namespace docent::app
