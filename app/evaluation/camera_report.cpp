// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/camera_report.h"

#include <nlohmann/json.hpp>

#include "app/evaluation/evaluate_run.h"
#include "app/files/checked_file.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

Json Percentiles(const std::vector<double>& values) {
  if (values.empty()) return nullptr;
  return {{"median", Quantile(values, 0.5)}, {"p95", Quantile(values, 0.95)}, {"max", Quantile(values, 1)}};
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
  tracking_ms_.push_back(Milliseconds(frame.tracking_time));
}

std::string FormatCameraReport(const std::vector<CameraTally>& cameras) {
  Json list = Json::array();
  for (const CameraTally& camera : cameras) {
    list.push_back(
        {{"name", camera.name_},
         {"frames", camera.frames_},
         {"with_pose", camera.with_pose_},
         {"dropped", camera.dropped_},
         {"tracking_ms", Percentiles(camera.tracking_ms_)},
         {"latency_ms",
          {{"tracked", Percentiles(camera.tracked_ages_ms_)}, {"drawn", Percentiles(camera.drawn_ages_ms_)}}},
         {"drawn_interval_ms", Percentiles(camera.drawn_intervals_ms_)},
         {"delivery", camera.delivery_ ? ToJson(*camera.delivery_) : Json(nullptr)}});
  }
  const Json json = {{"cameras", list}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void WriteCameraReport(const std::filesystem::path& path, const std::vector<CameraTally>& cameras) {
  CheckedFile file(path);
  file.Write(FormatCameraReport(cameras));
  file.Close();
}

}  // namespace docent::app
