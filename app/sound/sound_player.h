// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "app/sound/sound_director.h"
#include "engine/base/worker.h"

namespace docent::app {

// Plays sounds with OpenAL on a thread of its own, which decodes them piece by piece and opens the device
// when the first one is to be played. Without OpenAL or a device nothing is heard, and a sentence says so
// once; everything else goes on. A device that is missing or was lost is opened again for a later sound. Any
// thread; no call waits for the device.
class SoundPlayer {
 public:
  // `retry`: how long no device is opened after that has failed.
  explicit SoundPlayer(std::chrono::milliseconds retry = std::chrono::seconds(30));
  // Stops all sounds.
  ~SoundPlayer();
  SoundPlayer(const SoundPlayer&) = delete;
  SoundPlayer& operator=(const SoundPlayer&) = delete;

  // Orders that come faster than the device takes them are dropped, the oldest first.
  void Give(const SoundDirector::Orders& orders);
  // Why something is not heard, as a sentence, once; empty otherwise.
  std::string TakeProblem();

 private:
  void Run(const std::stop_token& stop);
  // Waits for orders up to a while; empty when there are none, or a stop is requested.
  std::optional<SoundDirector::Orders> Next(const std::stop_token& stop);
  void Report(const std::string& problem);

  const std::chrono::milliseconds retry_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<SoundDirector::Orders> orders_;  // Guarded by mutex_, as the problem.
  std::string problem_;
  bool reported_ = false;
  std::optional<Worker> worker_;  // Last: it uses the members above.
};

}  // namespace docent::app
