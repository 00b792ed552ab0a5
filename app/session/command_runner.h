// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "app/session/frame_loop.h"
#include "engine/base/worker.h"

namespace docent::app {

// Executes the commands of a camera that are due, from its script and from its inbox, and reports them. On
// the camera's thread.
class CommandRunner {
 public:
  // The options and the session must outlive this object.
  CommandRunner(const FrameLoopOptions& options, Session* session)
      : options_(options), session_(session), next_(options.script.begin()) {}

  // now: time since the first image. Throws Error for a command of the script that cannot be executed; what
  // the inbox asks for in vain is reported to FrameLoopOptions::refused instead.
  void RunDue(Timestamp now, const engine::TrackedFrame& frame);
  // The same without the script, whose commands wait for a frame that is tracked. But in lockstep, a file
  // that a command places is read on another thread; the command and those after it are carried out later
  // then, unless `waits`.
  void RunGiven(Timestamp now, const engine::TrackedFrame& frame, bool waits = false);
  // Throws Error if the images ended before the last command of the script.
  void CheckAllDone() const;

 private:
  std::string Line(const TimedCommand& command) const;
  void Run(const Command& command, Timestamp time, const engine::TrackedFrame& frame);
  // Starts to read what the first of the given commands places, and returns whether that goes on.
  bool IsReading();

  const FrameLoopOptions& options_;
  Session* const session_;
  std::vector<TimedCommand>::const_iterator next_;
  Timestamp last_time_{};                  // the times of a recorded script must not decrease
  std::deque<CommandInbox::Entry> given_;  // taken from the inbox, and not carried out
  std::chrono::steady_clock::time_point read_since_;
  bool is_reading_reported_ = false;
  std::unique_ptr<Worker> reading_;  // what the first of them places; null if nothing is read
};

}  // namespace docent::app
