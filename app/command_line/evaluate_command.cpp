// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/command_line/program.h"
#include "app/command_line/run_arguments.h"
#include "app/files/text_file.h"

namespace docent::app {

namespace {

// A whole number from 1 to most.
void AddCountOption(CLI::App* command, const std::string& option, std::size_t* target, std::size_t most,
                    const std::string& description) {
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& text) {
            const auto number = ParseInteger(text);
            if (!number || *number < 1 || static_cast<std::size_t>(*number) > most) {
              throw CLI::ValidationError(option,
                                         "'" + text + "' is no number from 1 to " + std::to_string(most));
            }
            *target = static_cast<std::size_t>(*number);
          },
          description)
      ->type_name("N");
}

void AddDistributionOptions(CLI::App* command, EvaluateOptions* options) {
  constexpr std::size_t kMostSeeds = 1000, kMostStarts = 1'000'000, kMostJobs = 256;
  AddCountOption(command, "--seeds", &options->seeds, kMostSeeds,
                 "Run each sequence with N seeds of the engine, from --seed on, and report the spread; "
                 "a simulated world stays that of --seed");
  AddCountOption(
      command, "--starts", &options->starts, kMostStarts,
      "Run N windows over each sequence, each as if the sequence began there, and report the "
      "spread; with --seeds every window has all seeds. Windows of a length (--window) that fit lie "
      "within the sequence, so that all are equally long");
  AddSecondsOption(command, "--window", &options->window,
                   "End each run so long after its first image (0: at the end of the sequence)");
  command
      ->add_option_function<std::string>(
          "--truth-noise",
          [options](const std::string& text) {
            const auto metres = ParseNumber(text);
            if (!metres || *metres < 0)
              throw CLI::ValidationError("--truth-noise", "'" + text + "' is no length in metres");
            options->truth_noise_m = *metres;
          },
          "Standard deviation of the true positions of recorded sequences, for telling false starts (default "
          "0.01)")
      ->type_name("METRES");
  AddCountOption(command, "--jobs", &options->jobs, kMostJobs,
                 "Run so many of the seeds and starts at a time; with --pace lockstep only");
}

}  // namespace

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
  const auto when_lost = std::make_shared<std::optional<WhenLost>>();
  AddWhenLostOption(command, when_lost.get(), "new");
  command->add_flag("--turn-about-camera", options->turn_about_camera,
                    "Take every turn to be about the camera's own centre, not the wearer's; for comparison");
  command->add_flag("--leave-loops-open", options->leave_loops_open,
                    "Do not put maps right when the camera is back where they began; for comparison");
  command->add_flag("--compare", options->compare,
                    "Run each sequence with the other engine too, and show both side by side");
  command
      ->add_option(
          "--dump-frame", options->dump_frames,
          "Write everything about frame N (from 0) of each sequence, as images and JSON; may be repeated")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->allow_extra_args(false);
  AddSeedOption(command, &options->seed);
  AddDistributionOptions(command, options.get());
  command->callback([=, run = std::move(run)] {
    if (options->calibrations.size() > options->sequences.size()) {
      throw CLI::ValidationError("--calibration", "more calibrations than sequences");
    }
    options->pace = pace->value_or(Pace::kEager);
    options->when_lost = when_lost->value_or(WhenLost::kNew);
    if (options->many_runs() && !options->dump_frames.empty())
      throw CLI::ValidationError("--dump-frame", "works with one run, without --seeds and --starts");
    if (options->jobs > 1 && options->pace != Pace::kLockstep)
      throw CLI::ValidationError("--jobs", "needs --pace lockstep, as other paces depend on a free machine");
    invocation->run = [=] { run(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
