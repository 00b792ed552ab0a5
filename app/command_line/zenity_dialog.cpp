// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/zenity_dialog.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <sstream>
#include <vector>

extern char** environ;

namespace docent::app {

namespace {

constexpr const char* kDialogProgram = "zenity";

}  // namespace

bool ZenityDialog::IsAvailable() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (!folder.empty() && access((folder + "/" + kDialogProgram).c_str(), X_OK) == 0) return true;
  }
  return false;
}

ZenityDialog::~ZenityDialog() {
  if (pipe_ >= 0) close(pipe_);
  if (child_ <= 0) return;
  kill(child_, SIGTERM);
  waitpid(child_, nullptr, 0);
}

bool ZenityDialog::Open(const std::string& title, const std::string& patterns) {
  if (is_open()) return true;
  std::array<int, 2> channel{};
  if (pipe2(channel.data(), O_CLOEXEC) != 0) return false;
  std::vector<std::string> arguments = {kDialogProgram, "--file-selection", "--title=" + title,
                                        "--file-filter=" + patterns, "--file-filter=*"};
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, channel[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = -1;
  const int problem = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(channel[1]);
  if (problem != 0) {
    close(channel[0]);
    return false;
  }
  fcntl(channel[0], F_SETFL, O_NONBLOCK);
  child_ = child;
  pipe_ = channel[0];
  output_.clear();
  return true;
}

std::optional<std::filesystem::path> ZenityDialog::Poll() {
  if (!is_open()) return std::nullopt;
  constexpr std::size_t kMostBytes = 1 << 16;
  std::array<char, 4096> part;
  for (ssize_t count = 0; (count = read(pipe_, part.data(), part.size())) > 0;)
    if (output_.size() < kMostBytes) output_.append(part.data(), static_cast<std::size_t>(count));
  int status = 0;
  if (waitpid(child_, &status, WNOHANG) != child_) return std::nullopt;
  for (ssize_t count = 0; (count = read(pipe_, part.data(), part.size())) > 0;)
    if (output_.size() < kMostBytes) output_.append(part.data(), static_cast<std::size_t>(count));
  close(pipe_);
  child_ = pipe_ = -1;
  const std::string line = output_.substr(0, output_.find('\n'));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || line.empty()) return std::nullopt;
  return line;
}

}  // namespace docent::app
