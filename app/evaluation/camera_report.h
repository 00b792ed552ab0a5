// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/cameras/frame_source.h"
#include "engine/base/time.h"
#include "engine/tracking/tracked_frame.h"

// Statistics of each camera that `author` and `tour` write to report.json: frame counts and latencies.
namespace docent::app {

// Collects the statistics of one camera. One thread at a time.
class CameraTally {
 public:
  explicit CameraTally(std::string name) : name_(std::move(name)) {}

  // Adds a frame; dropped frames are counted too.
  void Add(const engine::TrackedFrame& frame);
  // Adds the time since capture when an image was tracked and when it was drawn. Unknown for recordings that
  // are not played in real time.
  void AddTrackedAge(Timestamp age) { tracked_ages_ms_.push_back(Milliseconds(age)); }
  void AddDrawnAge(Timestamp age) { drawn_ages_ms_.push_back(Milliseconds(age)); }
  // Adds that an image was drawn, at this time of one clock.
  void AddDrawn(Timestamp now) {
    if (last_drawn_) drawn_intervals_ms_.push_back(Milliseconds(now - *last_drawn_));
    last_drawn_ = now;
  }
  // Sets the delivery statistics of a device, at the end of the run.
  void SetDelivery(const Delivery& delivery) { delivery_ = delivery; }

 private:
  friend std::string FormatCameraReport(const std::vector<CameraTally>& cameras);
  static double Milliseconds(Timestamp age) { return 1e3 * ToSeconds(age); }

  std::string name_;
  int frames_ = 0, with_pose_ = 0, dropped_ = 0;
  std::vector<double> tracking_ms_, tracked_ages_ms_, drawn_ages_ms_, drawn_intervals_ms_;
  std::optional<Timestamp> last_drawn_;
  std::optional<Delivery> delivery_;
};

// JSON: {"cameras": [{name, frames, with_pose, dropped, tracking_ms {median, p95, max}, latency_ms {tracked,
// drawn}, drawn_interval_ms, delivery}]}; unknown values are null.
std::string FormatCameraReport(const std::vector<CameraTally>& cameras);
// Throws Error.
void WriteCameraReport(const std::filesystem::path& path, const std::vector<CameraTally>& cameras);

}  // namespace docent::app
