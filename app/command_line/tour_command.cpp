// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "app/command_line/hub_command.h"
#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"

namespace docent::app {

void AddTourCommand(CLI::App* program, Invocation* invocation,
                    std::function<void(const TourOptions&, Verbosity)> run) {
  CLI::App* command =
      AddSubcommand(program, "tour", "Tour saved maps (read-only)",
                    "docent tour --library museum.docent --camera /dev/video0 --calibration camera.yaml");
  const auto options = std::make_shared<TourOptions>();
  AddLibraryOption(command, LibraryUse::kRead, &options->library, invocation);
  command
      ->add_option("--tour", options->tour,
                   "Lead the visitor along this tour, which docent maps tour create has stored")
      ->type_name("NAME");
  command->add_flag(
      "--narrate", options->narrate,
      "Speak where the visitor is, what to do, the way on and the texts in view, by the speech service "
      "of the desktop (Speech Dispatcher)");
  command
      ->add_option_function<std::string>(
          "--view",
          [options](const std::string& word) {
            if (word != "camera" && word != "glasses")
              throw CLI::ValidationError("--view", "'" + word + "' is not one of camera|glasses");
            options->glasses = word == "glasses";
          },
          "The camera's image with the content, or for a see-through display that is worn the content on "
          "black, "
          "for the left eye in the left half of the window and for the right eye in the right one (default "
          "camera)")
      ->type_name("camera|glasses");
  command
      ->add_option(
          "--display", options->display,
          "With --view glasses: the calibration of the display, which says how each eye sees through it")
      ->type_name("FILE");
  command->add_flag(
      "--gaze", options->gaze,
      "Open cards by gaze, for visitors whose hands are not free: a card opens for an object that stays in "
      "the "
      "middle of the image for 1.5 s, its pages turn by themselves, and it closes when the visitor looks "
      "elsewhere");
  command
      ->add_option(
          "--log", options->log,
          "Folder to which a record of each visit is added, without images: where the visitor was, how long, "
          "and where the camera was lost (see docent report)")
      ->type_name("DIR");
  command
      ->add_option("--kiosk", options->kiosk,
                   "Run in full screen on a device that visitors take: only typing the code in this file (4 "
                   "to 12 digits) "
                   "ends the program, it restarts after a failure, and a new visit begins when the device "
                   "was left for "
                   "two minutes")
      ->type_name("FILE");
  AddHubOption(command, &options->hub)
      ->description(
          "Follow the hub at this address, postgresql://user@host/database, as long as it can be reached; "
          "DOCENT_HUB if not given");
  command->add_option("--script", options->script, "Commands to carry out at given times, such as tour skip")
      ->type_name("FILE");
  AddRunArguments(command,
                  "take the calibration that the library has stored for a camera of this name; a tour builds "
                  "no map and estimates none",
                  &options->run);
  command->callback([=, run = std::move(run)] {
    CheckRunArguments(options->run);
    if (options->run.record) {
      std::vector<OptionFile> inputs = {{"--library", options->library}};
      if (options->display) inputs.push_back({"--display", *options->display});
      if (options->script) inputs.push_back({"--script", *options->script});
      if (options->kiosk) inputs.push_back({"--kiosk", *options->kiosk});
      CheckOutputFiles({{"--record", *options->run.record}}, inputs);
    }
    if (options->kiosk && options->run.headless)
      throw CLI::ValidationError("--kiosk", "needs a window; remove --headless");
    options->hub = HubOfSession(options->hub, *invocation);
    if (options->glasses != options->display.has_value())
      throw CLI::ValidationError("--display", "goes together with --view glasses");
    if (options->glasses && options->run.headless)
      throw CLI::ValidationError("--view", "glasses needs a window; remove --headless");
    if (options->glasses && options->run.record)
      throw CLI::ValidationError("--record", "records what a camera sees; remove it or --view glasses");
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
