// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_arguments.h"

#include <CLI/CLI.hpp>
#include <map>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

template <typename Choice>
std::string JoinedNames(const std::map<std::string, Choice>& names) {
  std::string joined;
  for (const auto& [name, choice] : names) joined += (joined.empty() ? "" : "|") + name;
  return joined;
}

// A word that stands for one of a few values; anything else is an error that names them all.
template <typename Choice, typename Target>
void AddChoice(CLI::App* command, const std::string& option, Target* target, const std::string& description,
               const std::map<std::string, Choice>& names) {
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& word) {
            const auto found = names.find(word);
            if (found == names.end()) {
              throw CLI::ValidationError(option, "'" + word + "' is none of " + JoinedNames(names));
            }
            *target = found->second;
          },
          description)
      ->type_name(JoinedNames(names));
}

}  // namespace

void AddSecondsOption(CLI::App* command, const std::string& option, Timestamp* target,
                      const std::string& description) {
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& text) {
            const auto time = ParseSeconds(text);
            if (!time || *time < Timestamp{}) {
              throw CLI::ValidationError(option, "'" + text + "' is no number of seconds");
            }
            *target = *time;
          },
          description)
      ->type_name("SECONDS");
}

void AddPaceOption(CLI::App* command, std::optional<Pace>* pace) {
  AddChoice<Pace>(command, "--pace", pace, "How images are fed",
                  {{"lockstep", Pace::kLockstep}, {"eager", Pace::kEager}, {"realtime", Pace::kRealtime}});
}

void AddEngineOption(CLI::App* command, EngineKind* engine) {
  AddChoice<EngineKind>(
      command, "--engine", engine,
      "With panorama maps for turns on the spot (the default), or plain six degrees of freedom",
      {{"hybrid", EngineKind::kHybrid}, {"sixdof", EngineKind::kSixDof}});
}

void AddWhenLostOption(CLI::App* command, std::optional<WhenLost>* when_lost, const std::string& otherwise) {
  AddChoice<WhenLost>(
      command, "--when-lost", when_lost,
      "What a camera does that is lost where no map is recognised: begin a new map, which is "
      "joined with a known one where they overlap, or wait until it sees a map again (default: " +
          otherwise + ")",
      {{"new", WhenLost::kNew}, {"wait", WhenLost::kWait}});
}

void AddSeedOption(CLI::App* command, std::uint64_t* seed) {
  // Read as text: the parser's own numbers would let -1 wrap round to the largest seed.
  command
      ->add_option_function<std::string>(
          "--seed",
          [=](const std::string& text) {
            const auto value = ParseInteger(text);
            if (!value || *value < 0)
              throw CLI::ValidationError("--seed", "'" + text + "' is no whole number from 0 on");
            *seed = static_cast<std::uint64_t>(*value);
          },
          "Fixes every random choice")
      ->type_name("N");
}

void AddCameraFormatOption(CLI::App* command, CameraOptions* options) {
  command
      ->add_option_function<std::string>(
          "--camera-format",
          [options](const std::string& text) {
            try {
              options->device_format = ParseDeviceFormat(text);
            } catch (const Error& error) {
              throw CLI::ValidationError("--camera-format", error.what());
            }
          },
          "Size and rate that a device should deliver")
      ->type_name("640x480@30");
}

void AddLensOption(CLI::App* command, std::optional<engine::LensModel>* lens) {
  using engine::LensModel;
  AddChoice<std::optional<LensModel>>(command, "--lens", lens,
                                      "Model of the lens; auto takes the one that predicts unseen views best",
                                      {{"auto", std::nullopt},
                                       {"radial_tangential", LensModel::kRadialTangential},
                                       {"fov", LensModel::kFov},
                                       {"kannala_brandt", LensModel::kKannalaBrandt}});
}

void AddRunArguments(CLI::App* command, RunArguments* run) {
  command
      ->add_option("--camera", run->cameras.sources,
                   "A device, a video file, a folder with an image sequence, or sim:SCENE[,OPTION=NUMBER...] "
                   "(see docent simulate --help); twice for the wearable")
      ->required()
      ->type_name("SOURCE")
      ->allow_extra_args(false);
  command
      ->add_option("--calibration", run->cameras.calibrations, "Calibration of each camera, in their order")
      ->type_name("FILE")
      ->allow_extra_args(false);
  AddCameraFormatOption(command, &run->cameras.options);
  AddSecondsOption(command, "--from", &run->cameras.from, "Begin so long after the first image");
  AddSecondsOption(command, "--until", &run->cameras.until, "End so long after the first image");
  AddPaceOption(command, &run->pace);
  AddEngineOption(command, &run->engine);
  AddSeedOption(command, &run->seed);
  AddMemoryOption(command, &run->memory_budget_bytes);
  command
      ->add_option_function<std::string>(
          "--baseline",
          [run](const std::string& text) {
            const auto metres = ParseNumber(text);
            if (!metres || *metres <= 0)
              throw CLI::ValidationError("--baseline", "'" + text + "' is no length in metres");
            run->baseline_m = *metres;
          },
          "Distance of two cameras that are fixed to one another; tells the scale of their maps")
      ->type_name("METRES");
  AddChoice<std::optional<HeadPolicy>>(
      command, "--head", &run->head,
      "What a camera that can turn its head looks at; when it is lost it looks for the map",
      {{"gaze", HeadPolicy::kFollowGaze}, {"map", HeadPolicy::kKeepMapInView}});
  command->add_flag("--headless", run->headless, "Open no window");
  command->add_option("--output", run->output, "Folder for trajectory, frames and events")->type_name("DIR");
  command->add_option("--record", run->record, "Write the augmented view as a video")->type_name("FILE.mp4");
}

void AddMemoryOption(CLI::App* command, std::size_t* bytes) {
  command
      ->add_option_function<std::string>(
          "--memory-budget",
          [=](const std::string& text) {
            constexpr std::pair<std::string_view, int> kUnits[] = {{"KiB", 10}, {"MiB", 20}, {"GiB", 30}};
            constexpr std::int64_t kMax = 1
                                          << 20;  // of any unit: far from where the product would wrap round
            for (const auto& [unit, shift] : kUnits) {
              if (!text.ends_with(unit)) continue;
              const auto number = ParseInteger(text.substr(0, text.size() - unit.size()));
              if (!number || *number < 1 || *number > kMax) break;
              *bytes = static_cast<std::size_t>(*number) << shift;
              return;
            }
            throw CLI::ValidationError("--memory-budget", "'" + text + "' is no size such as 512MiB or 1GiB");
          },
          "Memory for maps; those not used for longest make room (default 1GiB)")
      ->type_name("SIZE");
}

void CheckRunArguments(const RunArguments& run) {
  if (run.cameras.sources.size() > 2) throw CLI::ValidationError("--camera", "at most two cameras");
  if (run.cameras.calibrations.size() > run.cameras.sources.size()) {
    throw CLI::ValidationError("--calibration", "more calibrations than cameras");
  }
  if (run.baseline_m > 0 && run.cameras.sources.size() < 2) {
    throw CLI::ValidationError("--baseline", "lies between two cameras; give --camera twice");
  }
  if (run.cameras.until > Timestamp{} && run.cameras.until <= run.cameras.from) {
    throw CLI::ValidationError("--until", "does not lie after --from");
  }
}

}  // namespace docent::app
