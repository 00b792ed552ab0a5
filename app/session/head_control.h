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

// What a camera that can turn its head does with it while it is tracked.
enum class HeadPolicy { kFollowGaze, kKeepMapInView };

// Turns the head of one camera of a session by what the trackers say: while it is tracked it looks at what
// the other camera looks at, or where most of the map is; when it is lost it looks for the map (see
// HeadSearch). Told of every frame of every camera, on any thread; never waits for a device longer than its
// control takes.
class HeadControl {
 public:
  // head must outlive it; camera is the place of the head's camera in the session.
  HeadControl(Head* head, int camera, std::shared_ptr<const engine::CameraModel> model, HeadPolicy policy)
      : head_(head), camera_(camera), model_(std::move(model)), policy_(policy) {}

  void AddView(const engine::TrackedFrame& frame);
  bool searching() const;

 private:
  void Tracked(const engine::TrackedFrame& frame, const PanTilt& at);
  void Lost(const engine::TrackedFrame& frame, const PanTilt& at);
  void LookAt(const PanTilt& wanted, Timestamp now);

  Head* const head_;
  const int camera_;
  const std::shared_ptr<const engine::CameraModel> model_;
  const HeadPolicy policy_;
  mutable std::mutex mutex_;  // guards all that follows
  // Where the carrier was when its camera was tracked last.
  std::shared_ptr<const engine::MapSnapshot> map_;
  std::uint64_t map_key_ = 0;
  engine::Rigid3 carrier_from_map_;
  Timestamp tracked_at_{}, moved_at_{};
  std::optional<Eigen::Vector3d> gaze_;  // of the other camera, in the map of gaze_key_
  std::uint64_t gaze_key_ = 0;
  std::optional<HeadSearch> search_;
};

}  // namespace docent::app
