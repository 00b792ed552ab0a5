// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/command_line/program.h"
#include "app/command_line/progress.h"
#include "app/command_line/run_arguments.h"
#include "app/simulator/simulation.h"
#include "app/simulator/write_sequence.h"

namespace docent::app {

namespace {

struct SimulateOptions {
  std::string scene;
  std::filesystem::path output;
  SimulationOptions simulation;
};

void Simulate(const SimulateOptions& options, Verbosity verbosity) {
  const auto simulation = MakeSimulation(options.scene, options.simulation);
  {
    Progress progress("Frames", static_cast<std::uint64_t>(simulation->frame_count()), verbosity);
    WriteSequence(*simulation, options.output,
                  [&](int written, int) { progress.Update(static_cast<std::uint64_t>(written)); });
  }
  if (verbosity != Verbosity::kQuiet) {
    std::printf("%d frames in %s\n", simulation->frame_count(), options.output.string().c_str());
  }
}

}  // namespace

void AddSimulateCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* command =
      AddSubcommand(program, "simulate",
                    "Write a simulated sequence with its truth, in TUM layout. Scenes:\n" + ListOfScenes(),
                    "docent simulate museum --output museum --duration 20");
  const auto options = std::make_shared<SimulateOptions>();
  command->add_option("SCENE", options->scene, "Name of the scene, such as room or cylinder:10")->required();
  command->add_option("--output", options->output, "Folder to write to; new or empty")->required();
  SimulationOptions& simulation = options->simulation;
  command->add_option("--duration", simulation.duration_s, "Seconds at most; 0 for the whole way")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--fps", simulation.frame_rate_hz, "Pictures a second")->check(CLI::PositiveNumber);
  command->add_option("--noise", simulation.noise_sigma, "Noise, grey levels of 255")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--blur", simulation.blur_samples,
                   "Pictures averaged over an exposure; 1 for no motion blur")
      ->check(CLI::Range(1, 64));
  command->add_flag("--identical-places", simulation.identical_places,
                    "Make all bays and desks look the same");
  AddSeedOption(command, &simulation.seed);
  command->callback(
      [=] { invocation->run = [options, invocation] { Simulate(*options, invocation->verbosity); }; });
}

}  // namespace docent::app
