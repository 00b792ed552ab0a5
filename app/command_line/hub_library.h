// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace docent::app {

struct Invocation;

// What a command does with its library.
enum class LibraryUse : std::uint8_t {
  kRead,
  kChange,
  kAuthor,    // An author's session, which exchanges changes with a hub by itself.
  kCopyOnly,  // Reads this device's copy of a hub as it is, which may be damaged.
};

// A library that is given by the address of a hub (docs/hub.md). The command works on the copy of the hub on
// this device, so that it works without network too and no frame waits for the hub.
struct HubLibrary {
  std::string address;
  std::filesystem::path copy;  // The library's file.
  LibraryUse use = LibraryUse::kRead;
};

// Adds the required option --library, which `library` gets. It is a file or the address of a hub; then
// `library` gets the copy's file, and the invocation says what to exchange.
CLI::Option* AddLibraryOption(CLI::App* command, LibraryUse use, std::filesystem::path* library,
                              Invocation* invocation);

// The hub of a session: `hub`, the value of --hub, or the one that --library names. Throws
// CLI::ValidationError if these are two.
std::string HubOfSession(const std::string& hub, const Invocation& invocation);

// Runs a command on the copy, which gets the hub's changes first unless the command is about the copy itself;
// afterwards the hub gets what the command has changed. Without network the command works on the copy as it
// is, and a warning says so. Throws Error if there is neither a hub nor a copy, or if this user may not
// change what the command would.
void RunWithHubLibrary(const HubLibrary& library, const std::function<void()>& run);

}  // namespace docent::app
