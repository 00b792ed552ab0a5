// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "app/cameras/frame_source.h"
#include "app/session/play_clock.h"
#include "engine/base/worker.h"

namespace docent::app {

// Fetches the newest images of a source while an older one is being tracked for so long that the
// window would stand still: the search for a lost camera can take a second on a slow machine. Such images are
// shown without a pose and are not tracked. One thread uses this class; it has another one for the images.
class UntrackedImages {
 public:
  // Called on the other thread, while During has not returned.
  using Show = std::function<void(const engine::Frame&)>;
  // The arguments must outlive this object. `camera` is written to the frames.
  UntrackedImages(FrameSource* source, RealtimeClock* clock, int camera, Show show);

  // Does the work. When that takes longer than `after`, every kInterval the image that is due is fetched and
  // shown until it is done. `last` is the time of the image before them, and `offset` what the times of the
  // source are ahead of the clock. Nobody else may use the source meanwhile. Throws what the work throws,
  // else what the source throws.
  void During(const std::function<void()>& work, std::chrono::nanoseconds after, Timestamp last,
              Timestamp offset);
  // All images that were fetched since the last call, in their order and without their pixels.
  std::vector<engine::Frame> TakeFetched();
  // Whether the source has no further image.
  bool has_ended() const { return has_ended_; }

  // Twice as often as the five images a second that a window is to show, as not all are drawn.
  static constexpr std::chrono::milliseconds kInterval{100};

 private:
  void Run(const std::stop_token& stop);
  // Returns false if nothing more is to be fetched at present.
  bool Fetch(const std::stop_token& done);
  void Add(engine::Frame frame);

  FrameSource* const source_;
  RealtimeClock* const clock_;
  const int camera_;
  const Show show_;
  const bool is_live_;
  const Timestamp period_;
  // Of the thread that works at present: the other one while it fetches, else the one that uses this class.
  Timestamp last_{}, offset_{};
  std::vector<engine::Frame> fetched_;
  bool has_ended_ = false;

  std::mutex mutex_;  // Guards what follows.
  std::condition_variable_any changed_;
  bool is_wanted_ = false, is_fetching_ = false;
  std::chrono::steady_clock::time_point next_;
  std::stop_source done_;  // Requested when the work is done.
  std::exception_ptr fault_;
  Worker worker_;  // Last, so that the members above outlive it.
};

}  // namespace docent::app
