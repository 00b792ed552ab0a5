// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/maps_hub_command.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/command_line/hub_command.h"
#include "app/command_line/interruption.h"
#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "maps/hub/sync.h"

namespace docent::app {

namespace {

struct MapsHubOptions {
  maps::SyncOptions sync = SyncOptionsOf({}, {});  // The command line adds the hub and the library.
  double limit_kB_per_s = 0;                       // Of the transfer; 0 for none.
};
using MapsHubAction = maps::SyncReport (*)(const maps::SyncOptions& options);

void Exchange(MapsHubOptions options, MapsHubAction action, Verbosity verbosity) {
  const Interruption interruption;
  options.sync.bytes_per_second = static_cast<std::int64_t>(1000 * options.limit_kB_per_s);
  // A limit below a byte per second is no permission for any rate.
  if (options.limit_kB_per_s > 0 && options.sync.bytes_per_second == 0) options.sync.bytes_per_second = 1;
  options.sync.is_stopped = [] { return Interruption::requested(); };
  const maps::SyncReport report = action(options.sync);
  if (verbosity != Verbosity::kQuiet || report.problems > 0) {
    for (const std::string& line : report.lines) std::printf("%s\n", OneLine(line).c_str());
  }
  if (verbosity != Verbosity::kQuiet)
    std::printf("%s%.1f MB sent, %.1f MB received\n", report.lines.empty() ? "Library and hub agree: " : "",
                1e-6 * static_cast<double>(report.bytes_sent),
                1e-6 * static_cast<double>(report.bytes_received));
  if (report.problems > 0)
    throw Error(std::to_string(report.problems) +
                (report.problems == 1 ? " map or tour was" : " maps or tours were") +
                " left out; the lines above say why.");
}

}  // namespace

void AddMapsHubCommands(CLI::App* group, Invocation* invocation) {
  const auto options = std::make_shared<MapsHubOptions>();
  const auto add = [&](const char* name, const char* description, const char* example, MapsHubAction action) {
    CLI::App* command = AddSubcommand(group, name, description, example);
    command->add_option("NAME", options->sync.maps, "Names of maps; without one, all maps and the tours");
    command->add_option("--library", options->sync.library, "The library's file, NAME.docent")->required();
    AddHubOption(command, &options->sync.hub)->required();
    command
        ->add_option("--limit-rate", options->limit_kB_per_s,
                     "Transfer at most this many kB per second on average")
        ->check(CLI::Range(0.0, 1e9));
    command->callback([=] { invocation->run = [=] { Exchange(*options, action, invocation->verbosity); }; });
    return command;
  };
  add("push", "Save the changes of a library on a hub; what others changed there is merged",
      "docent maps push --library museum.docent --hub postgresql://anna@museum.example/docent", maps::Push)
      ->add_flag("--removed", options->sync.remove,
                 "Also remove from the hub what was removed from the library");
  add("pull", "Bring the changes of a hub into a library, which is created if it does not exist",
      "docent maps pull --library museum.docent --hub postgresql://anna@museum.example/docent", maps::Pull)
      ->add_option("--near", options->sync.near,
                   "Name of the map where the device is: it comes first, then those that tours and signposts "
                   "lead to from there, then the others");
}

}  // namespace docent::app
