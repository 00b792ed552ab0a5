// SPDX-License-Identifier: Apache-2.0
#include "app/sound/speech.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "engine/base/error.h"

extern char** environ;

namespace docent::app {

namespace {

constexpr std::size_t kMostTexts = 16;
constexpr const char* kSpeechProgram = "spd-say";
// The program passes the text on and ends; only a service that hangs, or is being started, takes longer.
constexpr auto kLongestCall = std::chrono::seconds(10);

// Passes a text to the service. Throws Error when that fails.
void Speak(const std::string& text, const std::string& language, const std::stop_token& stop) {
  std::array<std::string, 7> arguments = {
      kSpeechProgram, "--application-name=docent", "--priority=message", "--language", language, "--", text};
  std::array<char*, 8> argv{};
  for (std::size_t i = 0; i < arguments.size(); ++i) argv[i] = arguments[i].data();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
  pid_t child = -1;
  const int problem = posix_spawnp(&child, kSpeechProgram, &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (problem != 0) throw Error("Speech Dispatcher is not installed (spd-say)");
  const auto end = std::chrono::steady_clock::now() + kLongestCall;
  int status = 0;
  while (waitpid(child, &status, WNOHANG) != child) {
    const bool is_late = std::chrono::steady_clock::now() >= end;
    if (is_late || stop.stop_requested()) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      if (is_late) throw Error("the speech service does not answer");
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw Error("there is no speech service");
}

}  // namespace

Speech::Speech(std::string language, std::chrono::milliseconds retry)
    : language_(std::move(language)), retry_(retry) {
  worker_.emplace("speech", [this](const std::stop_token& stop) { Run(stop); });
}

Speech::~Speech() = default;

void Speech::Say(std::string text) {
  {
    const std::scoped_lock lock(mutex_);
    if (texts_.size() >= kMostTexts) texts_.pop_front();
    texts_.push_back(std::move(text));
  }
  changed_.notify_one();
}

std::string Speech::TakeProblem() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(problem_, {});
}

void Speech::Report(const std::string& problem) {
  const std::scoped_lock lock(mutex_);
  if (std::exchange(reported_, true)) return;
  problem_ = "Nothing is spoken: " + problem + ".";
}

std::optional<std::string> Speech::Next(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, stop, [this] { return !texts_.empty(); });
  if (texts_.empty() || stop.stop_requested()) return std::nullopt;
  std::string text = std::move(texts_.front());
  texts_.pop_front();
  return text;
}

void Speech::Run(const std::stop_token& stop) {
  std::chrono::steady_clock::time_point next_try{};
  while (const auto text = Next(stop)) {
    if (std::chrono::steady_clock::now() < next_try) continue;
    try {
      Speak(*text, language_, stop);
    } catch (const Error& error) {
      next_try = std::chrono::steady_clock::now() + retry_;
      Report(error.what());
    }
  }
}

}  // namespace docent::app
