// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/cameras/frame_source.h"
#include "app/evaluation/duration_histogram.h"
#include "engine/base/time.h"
#include "engine/tracking/tracked_frame.h"

// Statistics of each camera that `author` and `tour` write to report.json: frame counts and latencies.
namespace docent::app {

// What has happened to an image on its way to the screen: it was tracked, the window has taken it up, all is
// drawn (or given to a graphics processor), and it is on the screen or in the video.
enum class FrameStage { kTracked, kTaken, kDrawn, kShown };

// Collects the statistics of one camera. One thread at a time.
class CameraTally {
 public:
  explicit CameraTally(std::string name) : name_(std::move(name)) {}

  // Adds a frame; dropped frames are counted too.
  void Add(const engine::TrackedFrame& frame);
  // Adds the time since capture at the end of a stage. Unknown for recordings that are not played in real
  // time.
  void AddAge(FrameStage stage, Timestamp age) { ages_[static_cast<std::size_t>(stage)].Add(age); }
  // Adds that an image was shown, at this time of one clock.
  void AddShown(Timestamp now) {
    if (last_shown_) shown_intervals_.Add(now - *last_shown_);
    last_shown_ = now;
  }
  // Sets the delivery statistics of a device, at the end of the run.
  void SetDelivery(const Delivery& delivery) { delivery_ = delivery; }

 private:
  friend std::string FormatCameraReport(const std::vector<CameraTally>& cameras,
                                        double keyframe_queue_latency_s);

  std::string name_;
  int frames_ = 0, with_pose_ = 0, by_odometry_ = 0, dropped_ = 0;
  DurationHistogram tracking_times_, shown_intervals_;
  std::array<DurationHistogram, 4> ages_;  // By FrameStage.
  std::optional<Timestamp> last_shown_;
  std::optional<Delivery> delivery_;
};

// JSON: {"cameras": [{name, frames, with_pose, by_odometry, dropped, tracking_ms {median, p95, max},
// latency_ms {tracked, taken, drawn, shown}, drawn_interval_ms, delivery}], keyframe_queue_latency_ms};
// unknown values are null. keyframe_queue_latency_s: the longest time that a keyframe waited for the mapper.
std::string FormatCameraReport(const std::vector<CameraTally>& cameras, double keyframe_queue_latency_s);
// Throws Error.
void WriteCameraReport(const std::filesystem::path& path, const std::vector<CameraTally>& cameras,
                       double keyframe_queue_latency_s);

}  // namespace docent::app
