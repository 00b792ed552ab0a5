// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "app/calibration/board.h"
#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"
#include "engine/base/error.h"

namespace docent::app {

void AddCalibrateCommand(CLI::App* program, Invocation* invocation,
                         std::function<void(const CalibrateOptions&, Verbosity)> run) {
  CLI::App* command = AddSubcommand(
      program, "calibrate", "Calibrate a camera with a printed board",
      "docent calibrate --print board.pdf\n"
      "  docent calibrate --camera /dev/video0 --output camera.yaml\n"
      "  docent calibrate --camera images --board checkerboard:9x6:25 --output camera.yaml --headless");
  const auto options = std::make_shared<CalibrateOptions>();
  command->add_option("--camera", options->source, "A device, a video, or a folder of images of the board")
      ->type_name("SOURCE");
  command->add_option("--output", options->output, "The calibration file to write")->type_name("FILE");
  command
      ->add_option_function<std::string>(
          "--board",
          [options](const std::string& text) {
            try {
              ParseBoard(text);
            } catch (const Error& error) {
              throw CLI::ValidationError("--board", error.what());
            }
            options->board = text;
          },
          "checkerboard:COLUMNSxROWS:MM (inner corners) or charuco:COLUMNSxROWS:MM (squares); default " +
              options->board)
      ->type_name("BOARD");
  AddLensOption(command, &options->lens);
  AddCameraFormatOption(command, &options->camera);
  command->add_option("--print", options->print, "Write the board as a PDF to print at 100 %")
      ->type_name("FILE.pdf");
  command->add_flag("--headless", options->headless, "Open no window");
  command->callback([=, run = std::move(run)] {
    if (!options->print && (options->source.empty() || options->output.empty())) {
      throw CLI::ValidationError("calibrate", "give --camera and --output, or --print");
    }
    if (options->source.empty() != options->output.empty()) {
      throw CLI::ValidationError("calibrate", "--camera and --output must be given together");
    }
    std::vector<OptionFile> outputs, inputs;
    if (!options->source.empty()) {
      outputs.push_back({"--output", options->output});
      inputs.push_back({"--camera", options->source});
    }
    if (options->print) outputs.push_back({"--print", *options->print});
    CheckOutputFiles(outputs, inputs);
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
