// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "app/command_line/hub_command.h"
#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"

namespace docent::app {

void AddAuthorCommand(CLI::App* program, Invocation* invocation,
                      std::function<void(const AuthorOptions&, Verbosity)> run) {
  CLI::App* command =
      AddSubcommand(program, "author", "Build and extend maps, and place content in them",
                    "docent author --library museum.docent --camera /dev/video0 --calibration camera.yaml\n"
                    "  docent author --library room.docent --camera sim:hand --camera sim:shoulder");
  const auto options = std::make_shared<AuthorOptions>();
  AddLibraryOption(command, LibraryUse::kAuthor, &options->library, invocation);
  AddRunArguments(command,
                  "estimate the calibration while maps are built, and store it in the library under the "
                  "camera's name",
                  &options->run);
  command->add_option("--script", options->script, "Run the commands in this script file")->type_name("FILE");
  command->add_option("--record-script", options->record_script, "Record all commands as a script file")
      ->type_name("FILE");
  command
      ->add_option("--target", options->target,
                   "Initialize new maps from this printed image, so that they are in metres; needs "
                   "--target-width")
      ->type_name("IMAGE");
  AddMetresOption(command, "--target-width", kMinLength_m, &options->target_width_m,
                  "Width of the printed target");
  AddSecondsOption(command, "--autosave", &options->autosave_interval,
                   "Time between automatic saves; 0: save only when a map is left and at the end "
                   "(default 10)");
  command
      ->add_option("--ui-scale", options->ui_scale,
                   "Size of the window's panel and texts, times what the monitor suggests; 0.5 to 4 (default "
                   "1). A small window reduces it")
      ->type_name("FACTOR");
  AddHubOption(command, &options->hub)
      ->description(
          "Bring what others have changed on the hub at this address, postgresql://user@host/database, into "
          "the "
          "library first, and save on the hub what is saved in the library; DOCENT_HUB if not given");
  AddWhenLostOption(command, &options->when_lost, "new without a window, otherwise wait");
  command->callback([=, run = std::move(run)] {
    CheckRunArguments(options->run);
    std::vector<OptionFile> outputs, inputs = InputFilesOf(options->run);
    if (options->run.record) outputs.push_back({"--record", *options->run.record});
    if (options->record_script) outputs.push_back({"--record-script", *options->record_script});
    inputs.push_back({"--library", options->library});
    if (options->script) inputs.push_back({"--script", *options->script});
    if (options->target) inputs.push_back({"--target", *options->target});
    CheckOutputFiles(outputs, inputs);
    options->hub = HubOfSession(options->hub, *invocation);
    options->library_is_copy = invocation->hub_library.has_value();
    if (options->target.has_value() != (options->target_width_m > 0))
      throw CLI::ValidationError("--target", "--target and --target-width must be given together");
    if (!(options->ui_scale >= 0.5 && options->ui_scale <= 4))
      throw CLI::ValidationError("--ui-scale", "must be between 0.5 and 4");
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
