// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/camera_report.h"

#include <nlohmann/json.hpp>

#include "app/files/checked_file.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

Json Percentiles(const DurationHistogram& values) {
  if (values.count() == 0) return nullptr;
  return {
      {"median", values.Quantile_ms(0.5)}, {"p95", values.Quantile_ms(0.95)}, {"max", values.Quantile_ms(1)}};
}

Json ToJson(const Delivery& delivery) {
  return {{"delivered", delivery.delivered},
          {"missed", delivery.missed},
          {"late", delivery.late},
          {"broken", delivery.broken},
          {"reconnections", delivery.reconnections},
          {"latency_ms", 1e3 * ToSeconds(delivery.median_latency)}};
}

}  // namespace

void CameraTally::Add(const engine::TrackedFrame& frame) {
  ++frames_;
  if (frame.state == engine::TrackingState::kDropped) {
    ++dropped_;
    return;
  }
  with_pose_ += engine::HasPose(frame.state);
  by_odometry_ += frame.by_odometry;
  tracking_times_.Add(frame.tracking_time);
}

std::string FormatCameraReport(const std::vector<CameraTally>& cameras, double keyframe_queue_latency_s) {
  Json list = Json::array();
  for (const CameraTally& camera : cameras) {
    Json latencies;
    constexpr std::array<const char*, 4> kStages = {"tracked", "taken", "drawn", "shown"};
    for (std::size_t i = 0; i < kStages.size(); ++i) latencies[kStages[i]] = Percentiles(camera.ages_[i]);
    list.push_back({{"name", camera.name_},
                    {"frames", camera.frames_},
                    {"with_pose", camera.with_pose_},
                    {"by_odometry", camera.by_odometry_},
                    {"dropped", camera.dropped_},
                    {"tracking_ms", Percentiles(camera.tracking_times_)},
                    {"latency_ms", latencies},
                    {"drawn_interval_ms", Percentiles(camera.shown_intervals_)},
                    {"delivery", camera.delivery_ ? ToJson(*camera.delivery_) : Json(nullptr)}});
  }
  const Json json = {{"cameras", list}, {"keyframe_queue_latency_ms", 1e3 * keyframe_queue_latency_s}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void WriteCameraReport(const std::filesystem::path& path, const std::vector<CameraTally>& cameras,
                       double keyframe_queue_latency_s) {
  CheckedFile file(path);
  file.Write(FormatCameraReport(cameras, keyframe_queue_latency_s));
  file.Close();
}

}  // namespace docent::app
