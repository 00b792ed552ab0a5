// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"
#include "app/files/text_file.h"

namespace docent::app {

void AddAuthorCommand(CLI::App* program, Invocation* invocation,
                      std::function<void(const AuthorOptions&, Verbosity)> run) {
  CLI::App* command =
      AddSubcommand(program, "author", "Build and extend maps, and place content in them",
                    "docent author --library museum.docent --camera /dev/video0 --calibration camera.yaml\n"
                    "  docent author --library room.docent --camera sim:hand --camera sim:shoulder");
  const auto options = std::make_shared<AuthorOptions>();
  command->add_option("--library", options->library, "The library's file; made when it is not there")
      ->required();
  AddRunArguments(command, &options->run);
  command->add_option("--script", options->script, "Carry out the commands of this file")->type_name("FILE");
  command->add_option("--record-script", options->record_script, "Write what is done as a script")
      ->type_name("FILE");
  command
      ->add_option("--target", options->target,
                   "Start new maps from this printed image, in metres; see --target-width")
      ->type_name("IMAGE");
  command
      ->add_option_function<std::string>(
          "--target-width",
          [options](const std::string& text) {
            const auto metres = ParseNumber(text);
            if (!metres || *metres <= 0)
              throw CLI::ValidationError("--target-width", "'" + text + "' is no length in metres");
            options->target_width_m = *metres;
          },
          "How wide the target is as it hangs there")
      ->type_name("METRES");
  AddSecondsOption(command, "--autosave", &options->autosave_interval,
                   "Save so often; 0: only when a map is left and at the end (default 10)");
  AddWhenLostOption(command, &options->when_lost, "new without a window, else wait");
  command->callback([=, run = std::move(run)] {
    CheckRunArguments(options->run);
    if (options->target.has_value() != (options->target_width_m > 0))
      throw CLI::ValidationError("--target", "--target and --target-width are given together");
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
