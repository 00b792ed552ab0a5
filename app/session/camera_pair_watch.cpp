// SPDX-License-Identifier: Apache-2.0
#include "app/session/camera_pair_watch.h"

namespace docent::app {

bool CameraPairWatch::Update(std::size_t camera, double seconds, bool has_pose) {
  // A camera on a shoulder that sees the ceiling for a moment is found again within seconds.
  constexpr double kApart_s = 30, kRecent_s = 1;
  if (has_pose) {
    last_pose_s_.at(camera) = seconds;
    since_s_.at(camera).reset();
    return false;
  }
  const std::optional<double>& other = last_pose_s_.at(1 - camera);
  // Only the time counts during which the other camera is somewhere.
  if (!other || seconds - *other > kRecent_s) {
    since_s_.at(camera).reset();
    return false;
  }
  if (!since_s_.at(camera)) since_s_.at(camera) = seconds;
  if (has_said_ || seconds - *since_s_.at(camera) < kApart_s) return false;
  has_said_ = true;
  return true;
}

}  // namespace docent::app
