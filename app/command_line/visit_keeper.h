// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "app/session/guided_view.h"
#include "app/session/route_state.h"
#include "app/visits/visit_log.h"

namespace docent::app {

// Keeps the log of the visits with one camera of a tour. On the camera's thread.
class VisitKeeper {
 public:
  // `tour` is its name, empty for none. Throws Error when nothing can be written in the folder.
  VisitKeeper(const std::filesystem::path& folder, std::string tour) : tour_(std::move(tour)), log_(folder) {}

  // A frame of the camera. `route`: how far the visitor has come; null without a tour.
  void Add(const ShownFrame& frame, const RouteState* route);
  // Ends the visit; the next one begins with the next pose.
  void Next();
  // Ends the last visit, and waits until its record is written. Throws Error when it is missing.
  void Finish();
  // Why a record was not written, as a sentence, once; empty otherwise.
  std::string TakeProblem() { return log_.TakeProblem(); }

 private:
  const std::string tour_;
  VisitRecorder recorder_;
  VisitLog log_;
};

}  // namespace docent::app
