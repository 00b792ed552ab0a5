// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"

namespace docent::app {

void AddAuthorCommand(CLI::App* program, Invocation* invocation,
                      std::function<void(const AuthorOptions&, Verbosity)> run) {
  CLI::App* command =
      AddSubcommand(program, "author", "Build and extend maps, and place content in them",
                    "docent author --library museum.docent --camera /dev/video0 --calibration camera.yaml");
  const auto options = std::make_shared<AuthorOptions>();
  command->add_option("--library", options->library, "The library's file; made when it is not there")
      ->required();
  AddRunArguments(command, &options->run);
  command->add_option("--script", options->script, "Carry out the commands of this file")->type_name("FILE");
  command->add_option("--record-script", options->record_script, "Write what is done as a script")
      ->type_name("FILE");
  AddSecondsOption(command, "--autosave", &options->autosave_interval,
                   "Save so often; 0: only when a map is left and at the end (default 10)");
  command->callback([=, run = std::move(run)] {
    CheckRunArguments(options->run);
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
