// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "app/session/guided_view.h"
#include "engine/base/worker.h"
#include "ui/map_view.h"

namespace docent::app {

// The cells of a map's grid of predicted relocalization, ready to be drawn: see maps/relocalization_check.h.
// Every keyframe costs a search, a map a second or more. `stop` may be asked for meanwhile: the answer is
// then of the keyframes that were tried. The map has full features.
std::vector<ui::PredictedRecall> PredictRecall(const engine::MapSnapshot& map,
                                               const std::stop_token& stop = {});

// The author's other view: the map about the camera from above, with its content and colours that say where a
// visitor who is lost will be found again. The colours come a moment later than the map, from a thread of
// their own, and are made anew when keyframes have come or gone. Otherwise one thread, that of the window.
class MapPanel {
 public:
  ~MapPanel();
  // The frame's map; what was drawn last stays where a frame has none.
  void Draw(const ShownFrame& frame, int width_px, int height_px);
  void Present(int width_px, int height_px);

 private:
  void Predict(const std::shared_ptr<const engine::MapSnapshot>& map, std::uint64_t key);

  std::optional<ui::MapView> view_;
  int width_px_ = 0, height_px_ = 0;
  std::uint64_t predicted_key_ = 0;
  std::size_t predicted_keyframes_ = 0;
  std::mutex mutex_;  // guards the colours
  std::vector<ui::PredictedRecall> predicted_recall_;
  std::optional<Worker> worker_;  // last: it uses the rest
};

}  // namespace docent::app
