// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/hub_library.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string_view>

#include "app/command_line/interruption.h"
#include "app/command_line/program.h"
#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "maps/hub/administration.h"
#include "maps/hub/hub_connection.h"
#include "maps/hub/sha256.h"
#include "maps/hub/sync.h"

namespace docent::app {

namespace {

namespace fs = std::filesystem;

bool IsHubAddress(std::string_view library) {
  return library.starts_with("postgresql://") || library.starts_with("postgres://");
}

// The folder of the copies. They may hold changes that the hub has not got yet, so that they are no cache.
fs::path FolderOfCopies() {
  const auto folder = [](const char* variable) {
    const char* const value = std::getenv(variable);
    return fs::path(value != nullptr ? value : "");
  };
  if (const auto data = folder("XDG_DATA_HOME"); data.is_absolute()) return data / "docent" / "hubs";
  if (const auto home = folder("HOME"); home.is_absolute())
    return home / ".local" / "share" / "docent" / "hubs";
  throw Error("There is no folder for the copy of a hub; set HOME or XDG_DATA_HOME.");
}

// The copy's file: a name that people recognize, and a part of the address's hash, which makes it unique.
fs::path CopyOf(const std::string& address) {
  constexpr std::size_t kLongestName = 60, kHashDigits = 12;
  std::string name = address.substr(address.find("://") + 3);
  name = name.substr(0, std::min(name.find('?'), kLongestName));
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '@' && c != '_') c = '-';
  }
  return FolderOfCopies() / (name + "-" + maps::HashOf(address).substr(0, kHashDigits) + ".docent");
}

maps::SyncOptions SyncOptionsOfCopy(const HubLibrary& library) {
  maps::SyncOptions options = SyncOptionsOf(library.address, library.copy);
  // The copy holds nothing but the hub's maps, so that what was removed from it was removed by this user.
  options.remove = true;
  options.is_stopped = [] { return Interruption::requested(); };
  return options;
}

bool Exists(const fs::path& file) {
  std::error_code error;
  return fs::exists(file, error);
}

// Brings the hub's changes into the copy.
void Refresh(const HubLibrary& library) {
  const Interruption interruption;
  try {
    // The hub would refuse the change only after it was made in the copy.
    if (library.use == LibraryUse::kChange && maps::StatusOf(library.address, 0).role == "visitor")
      throw Error(
          "Your user has the role visitor on this hub and may not change its library; ask an admin of the "
          "hub for a user with the role curator.");
    const maps::SyncReport report = maps::Pull(SyncOptionsOfCopy(library));
    for (const std::string& line : report.lines)
      spdlog::log(report.problems > 0 ? spdlog::level::warn : spdlog::level::info, "{}", OneLine(line));
  } catch (const maps::HubUnreachable& unreachable) {
    if (!Exists(library.copy)) throw;
    spdlog::warn("{}; this device's copy of its library is used.", OneLine(unreachable.what()));
  }
}

// Saves the copy's changes on the hub.
void Deliver(const HubLibrary& library) {
  const Interruption interruption;
  try {
    const maps::SyncReport report = maps::Push(SyncOptionsOfCopy(library));
    for (const std::string& line : report.lines)
      spdlog::log(report.problems > 0 ? spdlog::level::warn : spdlog::level::info, "{}", OneLine(line));
    if (report.problems > 0)
      throw Error("The hub has not taken every change; the lines above say why. The changes are kept in '" +
                  library.copy.string() + "'.");
  } catch (const maps::HubUnreachable& unreachable) {
    spdlog::warn("{}; the change is saved on this device, and the hub gets it with the next change.",
                 OneLine(unreachable.what()));
  }
}

}  // namespace

CLI::Option* AddLibraryOption(CLI::App* command, LibraryUse use, fs::path* library, Invocation* invocation) {
  const char* const description =
      use == LibraryUse::kAuthor
          ? "The library's file, NAME.docent, which is created if it does not exist; or the address of a "
            "hub, "
            "postgresql://user@host/database"
          : "The library's file, NAME.docent, or the address of a hub, postgresql://user@host/database";
  return command
      ->add_option_function<std::string>(
          "--library",
          [=](const std::string& value) {
            *library = value;
            if (!IsHubAddress(value)) return;
            try {
              *library = CopyOf(value);
            } catch (const Error& error) {
              throw CLI::ValidationError("--library", error.what());
            }
            invocation->hub_library = HubLibrary{value, *library, use};
          },
          description)
      ->type_name("FILE")
      ->required();
}

std::string HubOfSession(const std::string& hub, const Invocation& invocation) {
  if (!invocation.hub_library) return hub;
  if (!hub.empty() && hub != invocation.hub_library->address)
    throw CLI::ValidationError("--hub", "--library names a hub already; remove --hub or DOCENT_HUB");
  return invocation.hub_library->address;
}

void RunWithHubLibrary(const HubLibrary& library, const std::function<void()>& run) {
  const std::string checked = maps::CheckedHubAddress(library.address);  // Throws before anything is made.
  std::error_code error;
  const fs::path folder = library.copy.parent_path();
  // The copies contain images of what cameras saw.
  if (fs::create_directories(folder, error)) fs::permissions(folder, fs::perms::owner_all, error);
  if (error)
    throw Error("The folder '" + folder.string() +
                "' for the copy of the hub cannot be made: " + error.message() + ".");
  if (library.use == LibraryUse::kAuthor) return run();
  if (library.use == LibraryUse::kCopyOnly && Exists(library.copy)) return run();
  Refresh(library);
  run();
  if (library.use == LibraryUse::kChange) Deliver(library);
}

}  // namespace docent::app
