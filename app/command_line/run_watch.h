// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/output/run_output.h"
#include "app/session/camera_pair_watch.h"
#include "app/session/load_watch.h"
#include "app/session/visitor_strings.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Notices what goes wrong in a run with its cameras: a machine that is too slow for their images, and a
// camera that is not where the other one is. Its caller makes sure that no two threads use it at a time.
class RunWatch {
 public:
  // The names of the cameras. `strings` is one of the constants behind VisitorStringsFor.
  RunWatch(std::vector<std::string> cameras, const VisitorStrings& strings)
      : cameras_(std::move(cameras)), strings_(strings), loads_(cameras_.size()) {}

  // What is to be reported of a frame, in order.
  struct Notices {
    std::vector<Event> events;
    std::string sentence;  // For the person at the first camera; empty for none.
  };
  Notices Add(const engine::TrackedFrame& tracked);

 private:
  void WatchLoad(std::size_t camera, const engine::TrackedFrame& tracked, Notices* notices);
  void WatchPair(std::size_t camera, const engine::TrackedFrame& tracked, Notices* notices);

  const std::vector<std::string> cameras_;
  const VisitorStrings& strings_;
  std::vector<LoadWatch> loads_;  // By camera.
  CameraPairWatch pair_;
};

}  // namespace docent::app
