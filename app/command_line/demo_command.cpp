// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"

namespace docent::app {

void AddDemoCommand(CLI::App* program, Invocation* invocation,
                    std::function<void(const DemoOptions&, Verbosity)> run) {
  CLI::App* command = AddSubcommand(
      program, "demo",
      "Build maps of the simulated museum, place content in them and tour them; needs no camera and no file",
      "docent demo --headless --output demo");
  const auto options = std::make_shared<DemoOptions>();
  command->add_flag("--headless", options->headless, "Open no window");
  command
      ->add_option("--output", options->output,
                   "Folder for images, video and report, and for the library museum.docent, which replaces "
                   "that of an earlier demonstration")
      ->type_name("DIR");
  command->add_option("--record", options->record, "Write the augmented view as a video")
      ->type_name("FILE.mp4");
  AddSeedOption(command, &options->seed);
  AddOcclusionOption(command, &options->occlusion);
  AddLightOption(command, &options->room_light);
  command->callback([=, run = std::move(run)] {
    if (options->headless && !options->output) {
      throw CLI::ValidationError("--headless",
                                 "needs --output DIR, because there is no window to show the results");
    }
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
