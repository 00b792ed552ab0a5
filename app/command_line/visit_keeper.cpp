// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/visit_keeper.h"

#include <chrono>

namespace docent::app {

void VisitKeeper::Add(const ShownFrame& frame, const RouteState* route) {
  const bool has_pose = engine::HasPose(frame.tracked.state);
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  auto ended =
      recorder_.Add(now, frame.seconds, has_pose ? frame.shown.map_name : std::string(),
                    has_pose ? frame.tracked.camera_from_map.OriginInSource() : Eigen::Vector3d::Zero());
  if (ended) log_.Add(std::move(*ended));
  if (route == nullptr) return;
  recorder_.SetTour(tour_, static_cast<std::uint32_t>(route->route().stops.size()),
                    static_cast<std::uint32_t>(route->CountSeen()));
}

void VisitKeeper::Next() {
  if (auto ended = recorder_.Finish()) log_.Add(std::move(*ended));
}

void VisitKeeper::Finish() {
  Next();
  log_.Close();
}

}  // namespace docent::app
