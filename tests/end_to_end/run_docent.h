// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "app/files/text_file.h"
#include "tests/app/support/temporary_folder.h"

extern char** environ;

// Helpers that run the real program as a user would, and read its output.
namespace docent::app {

// Starts the program with its standard output and errors in these files and the standard input from a file
// or terminal; by default it is empty. `can_stop`: in a process group of its own, so that SIGTSTP stops it
// wherever the test runs: it stops no group whose parents are all in another session.
inline pid_t StartDocent(std::vector<std::string> arguments, const std::string& output,
                         const std::string& errors, const std::string& input = "/dev/null",
                         bool can_stop = false) {
  arguments.insert(arguments.begin(), DOCENT_BINARY_DIR "/docent");
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, input.c_str(), O_RDONLY | O_NOCTTY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (can_stop) posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  const int spawned = posix_spawn(&child, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  EXPECT_EQ(spawned, 0) << "cannot start " << argv[0];
  return child;
}

struct Outcome {
  int exit_status = -1;
  std::string output, errors;
};

inline Outcome RunDocent(const std::vector<std::string>& arguments) {
  const TemporaryFolder folder;
  const std::string output = (folder / "out").string(), errors = (folder / "err").string();
  const pid_t child = StartDocent(arguments, output, errors);
  if (child == 0) return {};
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), ReadAll(output), ReadAll(errors)};
}

// Expects exactly one line on standard error, which contains `part`, nothing on standard output, and this
// exit status.
inline void ExpectErrorLine(const std::vector<std::string>& arguments, int exit_status,
                            const std::string& part) {
  const Outcome outcome = RunDocent(arguments);
  SCOPED_TRACE(testing::PrintToString(arguments));
  EXPECT_EQ(outcome.exit_status, exit_status);
  EXPECT_THAT(outcome.output, ::testing::IsEmpty());
  EXPECT_THAT(outcome.errors, ::testing::AllOf(::testing::StartsWith("docent: "), ::testing::HasSubstr(part),
                                               ::testing::EndsWith("\n")));
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
}

// A row of frames.csv, by column name.
using Row = std::map<std::string, std::string>;

inline std::vector<Row> ReadFrames(const std::filesystem::path& path) {
  std::istringstream text(ReadAll(path));
  std::string line;
  std::getline(text, line);
  const auto split = [](const std::string& whole) {
    std::vector<std::string> fields(1);
    for (const char c : whole) c == ',' ? fields.emplace_back() : fields.back() += c;
    return fields;
  };
  const std::vector<std::string> header = split(line);
  std::vector<Row> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> fields = split(line);
    EXPECT_EQ(fields.size(), header.size()) << line;
    Row row;
    for (std::size_t i = 0; i < std::min(fields.size(), header.size()); ++i) row[header[i]] = fields[i];
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace docent::app
