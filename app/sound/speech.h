// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "engine/base/worker.h"

namespace docent::app {

// Speaks texts by Speech Dispatcher, the speech service of the desktop. Its program `spd-say` is run for each
// text, on a thread of its own, because the calls of its library do not return when the service hangs.
// Without the service nothing is heard, and a sentence says so once; everything else goes on, and after a
// while the service is tried again. Any thread; no call waits for the service.
class Speech {
 public:
  // `language`: a tag as that of VisitorStrings. `retry`: how long nothing is spoken after a failure.
  explicit Speech(std::string language, std::chrono::milliseconds retry = std::chrono::seconds(30));
  // What the service has been given is still spoken.
  ~Speech();
  Speech(const Speech&) = delete;
  Speech& operator=(const Speech&) = delete;

  // Speaks the text after those before it. Texts that come faster than they are taken are dropped, the oldest
  // first.
  void Say(std::string text);
  // Why nothing is heard, as a sentence, once; empty otherwise.
  std::string TakeProblem();

 private:
  void Run(const std::stop_token& stop);
  std::optional<std::string> Next(const std::stop_token& stop);
  void Report(const std::string& problem);

  const std::string language_;
  const std::chrono::milliseconds retry_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::string> texts_;  // Guarded by mutex_, as the problem.
  std::string problem_;
  bool reported_ = false;
  std::optional<Worker> worker_;  // Last: it uses the members above.
};

}  // namespace docent::app
