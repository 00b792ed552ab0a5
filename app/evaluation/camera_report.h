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

// What authoring and touring tell of each camera in report.json: frames, and how long its images took.
namespace docent::app {

// Counts one camera's frames. One thread at a time.
class CameraTally {
 public:
  explicit CameraTally(std::string name) : name_(std::move(name)) {}

  // Every frame that is handed on, dropped ones too.
  void Add(const engine::TrackedFrame& frame);
  // How old an image was when it was tracked, and when it was drawn. Not known of recordings that are played
  // faster or slower than they were taken.
  void AddTrackedAge(Timestamp age) { tracked_ages_ms_.push_back(Milliseconds(age)); }
  void AddDrawnAge(Timestamp age) { drawn_ages_ms_.push_back(Milliseconds(age)); }
  // What a device says of its images' way, at the end.
  void SetDelivery(const Delivery& delivery) { delivery_ = delivery; }

 private:
  friend std::string FormatCameraReport(const std::vector<CameraTally>& cameras);
  static double Milliseconds(Timestamp age) { return 1e3 * ToSeconds(age); }

  std::string name_;
  int frames_ = 0, with_pose_ = 0, dropped_ = 0;
  std::vector<double> tracking_ms_, tracked_ages_ms_, drawn_ages_ms_;
  std::optional<Delivery> delivery_;
};

// JSON: {"cameras": [{name, frames, with_pose, dropped, tracking_ms {median, p95, max}, latency_ms {tracked,
// drawn}, delivery}]}; what is not known is null.
std::string FormatCameraReport(const std::vector<CameraTally>& cameras);
// Throws Error.
void WriteCameraReport(const std::filesystem::path& path, const std::vector<CameraTally>& cameras);

}  // namespace docent::app
