// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

namespace docent::app {

// Notices that one of two cameras is not recognized where the other one is, as when they are not worn
// together. Times are seconds of one clock. One thread.
class CameraPairWatch {
 public:
  // A frame of a camera (0 or 1), with or without a pose. Returns true once when this camera has had no pose
  // for half a minute although the other one has.
  bool Update(std::size_t camera, double seconds, bool has_pose);

 private:
  std::array<std::optional<double>, 2> since_s_;  // Without a pose.
  std::array<std::optional<double>, 2> last_pose_s_;
  bool has_said_ = false;
};

}  // namespace docent::app
