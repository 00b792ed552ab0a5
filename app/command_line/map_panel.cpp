// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/map_panel.h"

#include <utility>

#include "maps/maintenance/relocalization_check.h"

namespace docent::app {

std::vector<ui::PredictedRecall> PredictRecall(const engine::MapSnapshot& map, const std::stop_token& stop) {
  const auto trials =
      maps::LeaveEachKeyFrameOut(map, {}, [&](std::size_t) { return !stop.stop_requested(); });
  std::vector<ui::PredictedRecall> found;
  if (trials.empty()) return found;
  const maps::RelocalizationGrid grid = maps::MakeRelocalizationGrid(map, trials);
  for (const maps::RelocalizationCell& cell : grid.cells)
    found.push_back({cell.place, cell.view, grid.side, static_cast<double>(cell.found) / cell.trials});
  return found;
}

MapPanel::~MapPanel() {
  worker_.reset();
}

void MapPanel::Predict(const std::shared_ptr<const engine::MapSnapshot>& map, std::uint64_t key) {
  constexpr auto kOften = std::chrono::seconds(4);
  if (worker_ && !worker_->finished()) return;
  const auto now = std::chrono::steady_clock::now();
  if (predicted_key_ == key &&
      (predicted_keyframes_ == map->keyframes.size() || now - predicted_at_ < kOften)) {
    return;
  }
  predicted_at_ = now;
  predicted_key_ = key;
  predicted_keyframes_ = map->keyframes.size();
  worker_.emplace("recall", [this, map, key](const std::stop_token& stop) {
    std::vector<ui::PredictedRecall> found = PredictRecall(*map, stop);
    const std::scoped_lock lock(mutex_);
    predicted_recall_ = std::move(found);
    recall_key_ = key;
  });
}

void MapPanel::Draw(const ShownFrame& frame, int width_px, int height_px, bool has_title) {
  if (!view_ || width_px_ != width_px || height_px_ != height_px) {
    view_.emplace(ui::MapViewOptions{.width_px = width_px, .height_px = height_px});
    width_px_ = width_px;
    height_px_ = height_px;
  }
  const auto& map = frame.tracked.map;
  if (!map || map->keyframes.empty()) return;
  Predict(map, frame.tracked.map_key);
  const ui::Orbit orbit = ui::OrbitAbove(*map, static_cast<double>(width_px) / height_px);
  ui::MapViewContents contents;
  contents.scene = frame.shown.scene.get();
  contents.grey_points = true;
  if (has_title) contents.title = frame.shown.map_name;
  if (const auto& bounds = frame.shown.bounds) contents.boundary.emplace(bounds->min, bounds->max);
  if (engine::HasPose(frame.tracked.state)) contents.camera_from_map = frame.tracked.camera_from_map;
  {
    const std::scoped_lock lock(mutex_);
    if (recall_key_ == frame.tracked.map_key) contents.predicted_recall = predicted_recall_;
  }
  view_->Draw(*map, orbit, contents);
}

void MapPanel::Present(const ui::WindowPart& part) {
  if (view_) view_->Present(part);
}

}  // namespace docent::app
