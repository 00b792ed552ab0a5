// SPDX-License-Identifier: Apache-2.0
#include "app/session/command_runner.h"

#include <algorithm>
#include <new>
#include <utility>

#include "app/session/session_assets.h"
#include "engine/base/error.h"

namespace docent::app {

void CommandRunner::RunDue(Timestamp now, const engine::TrackedFrame& frame) {
  for (; next_ != options_.script.end() && next_->time <= now; ++next_) {
    try {
      Run(next_->command, now, frame);
    } catch (const Error& error) {
      const std::string sentence = error.what();
      throw Error(Line(*next_) + sentence + (sentence.ends_with('.') ? "" : "."));
    }
  }
  RunGiven(now, frame);
}

void CommandRunner::RunGiven(Timestamp now, const engine::TrackedFrame& frame, bool waits) {
  if (options_.inbox == nullptr) return;
  for (CommandInbox::Entry& entry : options_.inbox->TakeAll()) given_.push_back(std::move(entry));
  while (!given_.empty() && (!IsReading() || waits)) {
    const CommandInbox::Entry entry = std::move(given_.front());
    given_.pop_front();
    try {
      if (const auto reading = std::exchange(reading_, nullptr)) reading->Join();
      const engine::TrackedFrame& seen = entry.frame ? *entry.frame : frame;
      // Recorded with the time of the frame that the user saw, so that its pixel keeps its meaning on replay.
      Run(entry.command, now - (frame.frame.time - seen.frame.time), seen);
    } catch (const Error& error) {
      if (options_.refused) options_.refused(error.what());
    } catch (const std::bad_alloc&) {
      if (options_.refused) options_.refused("there is not enough memory for this");
    }
  }
}

bool CommandRunner::IsReading() {
  constexpr auto kLong = std::chrono::milliseconds(500);
  const Command& command = given_.front().command;
  const auto now = std::chrono::steady_clock::now();
  if (!reading_ && options_.pace != Pace::kLockstep && session_->MustRead(command, options_.model_folder)) {
    reading_ = std::make_unique<Worker>("asset", [this, command](const std::stop_token&) {
      session_->Preload(command, options_.model_folder);
    });
    read_since_ = now;
    is_reading_reported_ = false;
  }
  if (!reading_ || reading_->finished()) return false;
  if (options_.reading && now - read_since_ >= kLong && !std::exchange(is_reading_reported_, true))
    options_.reading(FileOf(command)->name);
  return true;
}

void CommandRunner::CheckAllDone() const {
  if (next_ == options_.script.end()) return;
  throw Error(Line(*next_) + "the images ended before the time of this command.");
}

std::string CommandRunner::Line(const TimedCommand& command) const {
  return options_.script_name + ", line " + std::to_string(command.line) + ": ";
}

void CommandRunner::Run(const Command& command, Timestamp time, const engine::TrackedFrame& frame) {
  if (!options_.take || !options_.take(command, frame))
    session_->Execute(command, frame, options_.model_folder);
  last_time_ = std::max(last_time_, time);
  if (options_.carried_out) options_.carried_out({last_time_, 0, command});
}

}  // namespace docent::app
