// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"
#include "app/files/text_file.h"

namespace docent::app {

namespace {

// Adds an option whose value is an integer from 1 to `most`.
void AddCountOption(CLI::App* command, const std::string& option, std::size_t* target, std::size_t most,
                    const std::string& description) {
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& text) {
            const auto number = ParseInteger(text);
            if (!number || *number < 1 || static_cast<std::size_t>(*number) > most) {
              throw CLI::ValidationError(
                  option, "'" + text + "' is not a whole number from 1 to " + std::to_string(most));
            }
            *target = static_cast<std::size_t>(*number);
          },
          description)
      ->type_name("N");
}

void AddDistributionOptions(CLI::App* command, EvaluateOptions* options) {
  constexpr std::size_t kMostSeeds = 1000, kMostStarts = 1'000'000, kMostJobs = 256;
  AddCountOption(command, "--seeds", &options->seeds, kMostSeeds,
                 "Run each sequence with N engine seeds (--seed, --seed + 1, ...) and report the spread; "
                 "the simulated world always uses --seed");
  AddCountOption(
      command, "--starts", &options->starts, kMostStarts,
      "Run N windows of each sequence, each as if the sequence began there, and report the spread; with "
      "--seeds each window is run with all seeds. If N windows of the length --window fit, they are placed "
      "within the sequence, so that all have the same length");
  AddSecondsOption(command, "--window", &options->window,
                   "Length of each run (0: to the end of the sequence)");
  AddMetresOption(
      command, "--truth-noise", 0, &options->truth_noise_m,
      "Standard deviation of the ground-truth positions of recorded sequences, used to detect false "
      "initializations (default 0.01)");
  AddCountOption(command, "--jobs", &options->jobs, kMostJobs,
                 "Number of runs in parallel; only with --pace lockstep");
}

}  // namespace

void AddEvaluateCommand(CLI::App* program, Invocation* invocation,
                        std::function<void(const EvaluateOptions&, Verbosity)> run) {
  CLI::App* command = AddSubcommand(program, "evaluate",
                                    "Run the engine on sequences with ground truth and report its accuracy",
                                    "docent evaluate kitchen room --output report --pace lockstep");
  const auto options = std::make_shared<EvaluateOptions>();
  const auto pace = std::make_shared<std::optional<Pace>>();
  command
      ->add_option(
          "SEQUENCE", options->sequences,
          "Folders with image sequences, or sim:SCENE[,OPTION=NUMBER...] (see docent simulate --help)")
      ->required();
  command
      ->add_option("--output", options->output,
                   "Folder for report.json, report.html and the files of each run")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--calibration", options->calibrations,
                   "Calibration file of each sequence, in the same order; auto: estimate the calibration, as "
                   "for a sequence without a calibration file")
      ->type_name("FILE")
      ->allow_extra_args(false);
  AddPaceOption(command, pace.get(), "eager");
  AddEngineOption(command, &options->engine);
  const auto when_lost = std::make_shared<std::optional<WhenLost>>();
  AddWhenLostOption(command, when_lost.get(), "new");
  command->add_flag("--turn-about-camera", options->turn_about_camera,
                    "Assume that pure rotations are about the camera centre and do not estimate the rotation "
                    "centre; for comparison");
  command->add_flag("--leave-loops-open", options->leave_loops_open, "Disable loop closing; for comparison");
  command->add_flag("--compare", options->compare,
                    "Also run each sequence with the other engine and show both side by side");
  command
      ->add_option("--dump-frame", options->dump_frames,
                   "Write the tracker's data for frame N (from 0) of each sequence as images and JSON; may "
                   "be repeated")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->allow_extra_args(false);
  AddSeedOption(command, &options->seed);
  AddDistributionOptions(command, options.get());
  command->callback([=, run = std::move(run)] {
    if (options->calibrations.size() > options->sequences.size()) {
      throw CLI::ValidationError("--calibration", "there are more calibrations than sequences");
    }
    options->pace = pace->value_or(Pace::kEager);
    options->when_lost = when_lost->value_or(WhenLost::kNew);
    if (options->many_runs() && !options->dump_frames.empty())
      throw CLI::ValidationError("--dump-frame", "cannot be combined with --seeds or --starts");
    if (options->jobs > 1 && options->pace != Pace::kLockstep)
      throw CLI::ValidationError(
          "--jobs", "needs --pace lockstep, because with other paces parallel runs would change the results");
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
