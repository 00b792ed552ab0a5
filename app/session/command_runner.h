// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/session/frame_loop.h"

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
  // The same without the script, whose commands wait for a frame that is tracked.
  void RunGiven(Timestamp now, const engine::TrackedFrame& frame);
  // Throws Error if the images ended before the last command of the script.
  void CheckAllDone() const;

 private:
  std::string Line(const TimedCommand& command) const;
  void Run(const Command& command, Timestamp time, const engine::TrackedFrame& frame);

  const FrameLoopOptions& options_;
  Session* const session_;
  std::vector<TimedCommand>::const_iterator next_;
  Timestamp last_time_{};  // the times of a recorded script must not decrease
};

}  // namespace docent::app
