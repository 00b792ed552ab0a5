// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "app/cameras/head.h"
#include "app/session/head_search.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Where a pan-tilt camera looks while it is tracked.
enum class HeadPolicy { kFollowGaze, kKeepMapInView };

// Controls the pan-tilt head of one camera of a session. While its camera is tracked, it points at what the
// other camera looks at, or where most of the map is visible; when its camera is lost, it searches for the
// map (see HeadSearch). Any thread; a call waits for the device at most as long as one control command takes.
class HeadControl {
 public:
  // head must outlive this; camera is the index in the session of the camera on the head.
  HeadControl(Head* head, int camera, std::shared_ptr<const engine::CameraModel> model, HeadPolicy policy)
      : head_(head), camera_(camera), model_(std::move(model)), policy_(policy) {}

  void AddView(const engine::TrackedFrame& frame);
  bool searching() const;

 private:
  void HandleTracked(const engine::TrackedFrame& frame, const PanTilt& at);
  void HandleLost(const engine::TrackedFrame& frame, const PanTilt& at);
  void LookAt(const PanTilt& wanted, Timestamp now);

  Head* const head_;
  const int camera_;
  const std::shared_ptr<const engine::CameraModel> model_;
  const HeadPolicy policy_;
  mutable std::mutex mutex_;  // guards the members below
  // Pose of the carrier when its camera was last tracked.
  std::shared_ptr<const engine::MapSnapshot> map_;
  std::uint64_t map_key_ = 0;
  engine::Rigid3 carrier_from_map_;
  Timestamp tracked_at_{}, moved_at_{};
  std::optional<Eigen::Vector3d> gaze_;  // of the other camera, in the map of gaze_key_
  std::uint64_t gaze_key_ = 0;
  std::optional<HeadSearch> search_;
};

}  // namespace docent::app
