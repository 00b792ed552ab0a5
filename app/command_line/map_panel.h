// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "app/session/guided_view.h"
#include "engine/base/worker.h"
#include "ui/map_view.h"

namespace docent::app {

// Predicts where a lost camera can be relocalized: leaves each keyframe out in turn, tries to relocalize it,
// and collects the results in grid cells; see maps/maintenance/relocalization_check.h. Each keyframe needs
// one search, so a map takes a second or more. After a request through `stop`, only the keyframes tried so
// far are counted. The keyframes must have their features in memory.
std::vector<ui::PredictedRecall> PredictRecall(const engine::MapSnapshot& map,
                                               const std::stop_token& stop = {});

// View of the active map from above for authors, with its content, with the camera, and with colours that
// show where a lost camera will be relocalized. The colours are computed on a worker thread and appear later
// than the map; they are computed again when the number of keyframes has changed, but not more often than
// every four seconds, so that they do not keep a processor busy while a map grows. All members are called on
// the window's thread.
class MapPanel {
 public:
  ~MapPanel();
  // Draws the frame's map, with its name and size if `has_title`. Without a map the last drawing stays. Sizes
  // in pixels.
  void Draw(const ShownFrame& frame, int width_px, int height_px, bool has_title);
  void Present(const ui::WindowPart& part);

 private:
  void Predict(const std::shared_ptr<const engine::MapSnapshot>& map, std::uint64_t key);

  std::optional<ui::MapView> view_;
  int width_px_ = 0, height_px_ = 0;
  std::uint64_t predicted_key_ = 0;
  std::size_t predicted_keyframes_ = 0;
  std::chrono::steady_clock::time_point predicted_at_{};
  std::mutex mutex_;  // Guards the next two.
  std::vector<ui::PredictedRecall> predicted_recall_;
  std::uint64_t recall_key_ = 0;  // The map that it belongs to.
  std::optional<Worker> worker_;  // Last member: its thread uses the others.
};

}  // namespace docent::app
