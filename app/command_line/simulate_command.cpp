// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cctype>
#include <cstdio>
#include <memory>
#include <string>

#include "app/command_line/program.h"
#include "app/command_line/progress.h"
#include "app/command_line/run_arguments.h"
#include "app/simulator/named_options.h"
#include "app/simulator/simulation.h"
#include "app/simulator/write_sequence.h"
#include "engine/base/error.h"

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

void AddNamedOption(CLI::App* command, const NamedOption& option, SimulationOptions* options) {
  const std::string dashed = "--" + std::string(option.name);
  std::string meaning = option.meaning;
  meaning[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(meaning[0])));
  const auto set = [dashed, &option, options](std::string_view text) {
    try {
      SetNamedOption(option, text, options);
    } catch (const Error& error) {
      throw CLI::ValidationError(dashed, error.what());
    }
  };
  if (option.unit == nullptr) {
    command->add_flag_callback(
        dashed, [set] { set(""); }, meaning);
    return;
  }
  command->add_option_function<std::string>(dashed, set, meaning)->type_name(option.unit);
}

}  // namespace

void AddSimulateCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* command = AddSubcommand(
      program, "simulate",
      "Write a simulated sequence with ground truth and calibration in TUM layout. The options can also be "
      "appended to the scene name after commas, as in sim:room,rolling-shutter=20,interlaced. Scenes:\n" +
          ListOfScenes(),
      "docent simulate museum --output museum --duration 20\n"
      "  docent simulate room --output room --rolling-shutter 25 --focal-error 1 --tremor 0.1");
  const auto options = std::make_shared<SimulateOptions>();
  command->add_option("SCENE", options->scene, "Name of the scene, such as room or cylinder:10")->required();
  command->add_option("--output", options->output, "Folder to write to; must be new or empty")->required();
  for (const NamedOption& option : NamedOptions()) AddNamedOption(command, option, &options->simulation);
  AddSeedOption(command, &options->simulation.seed);
  command->callback(
      [=] { invocation->run = [options, invocation] { Simulate(*options, invocation->verbosity); }; });
}

}  // namespace docent::app
