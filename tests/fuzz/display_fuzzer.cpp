// SPDX-License-Identifier: Apache-2.0
// Parses any bytes as the calibration of a display: the result must be two eyes with finite poses and lenses
// that project what is ahead of them, or a docent::Error.
#include <cstddef>
#include <cstdint>
#include <string>

#include "app/calibration/display_file.h"
#include "engine/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto display =
        docent::app::ParseDisplayCalibration(std::string(reinterpret_cast<const char*>(data), size), "fuzz");
    for (const docent::app::DisplayEye& eye : display.eyes) {
      if (!eye.eye_from_camera.rotation.matrix().allFinite()) __builtin_trap();
      if (!eye.eye_from_camera.translation.allFinite()) __builtin_trap();
      if (!eye.camera.Project(Eigen::Vector3d(0, 0, 1))) __builtin_trap();
    }
  } catch (const docent::Error&) {
  }
  return 0;
}
