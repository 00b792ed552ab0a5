// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/command_line/options.h"

namespace CLI {
class App;
}

// Options that several subcommands share, so that an option means the same everywhere.
namespace docent::app {

inline constexpr double kMinLength_m = 1e-6;  // of what a person measured

// `otherwise` is the default's name in the help text, here and below.
void AddPaceOption(CLI::App* command, std::optional<Pace>* pace, const std::string& otherwise);
void AddEngineOption(CLI::App* command, EngineKind* engine);
// Adds --when-lost.
void AddWhenLostOption(CLI::App* command, std::optional<WhenLost>* when_lost, const std::string& otherwise);
void AddSeedOption(CLI::App* command, std::uint64_t* seed);
// Adds an option whose value is a number of seconds, 0 or more.
void AddSecondsOption(CLI::App* command, const std::string& option, Timestamp* target,
                      const std::string& description);
// Adds an option whose value is a length in metres, from `least` to 10 km.
void AddMetresOption(CLI::App* command, const std::string& option, double least, double* target,
                     const std::string& description);
// Adds --occlusion: off, proxies or map.
void AddOcclusionOption(CLI::App* command, Occlusion* occlusion);
// Adds --light: room or plain.
void AddLightOption(CLI::App* command, bool* room_light);
void AddMemoryOption(CLI::App* command, std::size_t* bytes);
void AddCameraFormatOption(CLI::App* command, CameraOptions* options);
// Adds --lens: auto, or the name of a lens model.
void AddLensOption(CLI::App* command, std::optional<engine::LensModel>* lens);
// Adds the options that all subcommands with tracking share. `auto_calibration` is the help on
// `--calibration auto`.
void AddRunArguments(CLI::App* command, const std::string& auto_calibration, RunArguments* run);
// The file of an option.
struct OptionFile {
  std::string option;
  std::filesystem::path file;
};
// Throws CLI::ValidationError if an output would replace an input or another output, or the images of an
// input that is a recording.
void CheckOutputFiles(const std::vector<OptionFile>& outputs, const std::vector<OptionFile>& inputs);
// The files of a run that are read: recordings and calibrations.
std::vector<OptionFile> InputFilesOf(const RunArguments& run);
// The language of the locale in the environment; empty if it names none.
std::string LanguageOfEnvironment();
// Checks combinations of options after parsing: the number of cameras and calibrations, a baseline without a
// second camera, and --until before --from. Throws CLI::ValidationError.
void CheckRunArguments(const RunArguments& run);
// Throws Error if no library can store images of the camera's size. `source` is the name in the message.
void CheckStorableSize(const engine::CameraModel& camera, const std::string& source);

}  // namespace docent::app
