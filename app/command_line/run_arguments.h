// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/command_line/options.h"

namespace CLI {
class App;
}

// The options that several subcommands share, so that a word means the same everywhere.
namespace docent::app {

void AddPaceOption(CLI::App* command, std::optional<Pace>* pace);
void AddEngineOption(CLI::App* command, EngineKind* engine);
// --when-lost; `otherwise` names the default in the help.
void AddWhenLostOption(CLI::App* command, std::optional<WhenLost>* when_lost, const std::string& otherwise);
void AddSeedOption(CLI::App* command, std::uint64_t* seed);
// A number of seconds, 0 or more.
void AddSecondsOption(CLI::App* command, const std::string& option, Timestamp* target,
                      const std::string& description);
void AddMemoryOption(CLI::App* command, std::size_t* bytes);
void AddCameraFormatOption(CLI::App* command, CameraOptions* options);
// auto, or the name of a lens model.
void AddLensOption(CLI::App* command, std::optional<engine::LensModel>* lens);
// --camera, --calibration, --camera-format, --from, --until and all of the above, --headless, --output,
// --record.
void AddRunArguments(CLI::App* command, RunArguments* run);
// What only shows when everything is read: more calibrations than cameras, an end before the beginning, no
// output where there is no window either. Throws CLI::ValidationError.
void CheckRunArguments(const RunArguments& run);

}  // namespace docent::app
