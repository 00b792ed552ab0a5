// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"

namespace docent::app {

void AddEvaluateCommand(CLI::App* program, Invocation* invocation,
                        std::function<void(const EvaluateOptions&, Verbosity)> run) {
  CLI::App* command = AddSubcommand(
      program, "evaluate", "Run the engine on sequences with ground truth, and report how good it was",
      "docent evaluate kitchen room --output report --pace lockstep");
  const auto options = std::make_shared<EvaluateOptions>();
  const auto pace = std::make_shared<std::optional<Pace>>();
  command
      ->add_option(
          "SEQUENCE", options->sequences,
          "Folders with image sequences, or sim:SCENE[,OPTION=NUMBER...] (see docent simulate --help)")
      ->required();
  command->add_option("--output", options->output, "Folder for report.json, report.html and each run's files")
      ->required()
      ->type_name("DIR");
  command->add_option("--calibration", options->calibrations, "Calibration of each sequence, in their order")
      ->type_name("FILE")
      ->allow_extra_args(false);
  AddPaceOption(command, pace.get());
  AddEngineOption(command, &options->engine);
  command->add_flag("--turn-about-camera", options->turn_about_camera,
                    "Take every turn to be about the camera's own centre, not the wearer's; for comparison");
  command->add_flag("--leave-loops-open", options->leave_loops_open,
                    "Do not put maps right when the camera is back where they began; for comparison");
  command->add_flag("--compare", options->compare,
                    "Run each sequence with the other engine too, and show both side by side");
  command
      ->add_option(
          "--dump-frame", options->dump_frames,
          "Write everything about frame N (from 0) of each sequence, as pictures and JSON; may be repeated")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->allow_extra_args(false);
  AddSeedOption(command, &options->seed);
  command->callback([=, run = std::move(run)] {
    if (options->calibrations.size() > options->sequences.size()) {
      throw CLI::ValidationError("--calibration", "more calibrations than sequences");
    }
    options->pace = pace->value_or(Pace::kEager);
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
