// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/camera_faults.h"

#include <cmath>

namespace docent::app {

std::optional<std::string> CameraFaults::Validate(double frame_rate_hz) const {
  // The conditions are negated, so that NaN is rejected too.
  if (!(readout_s >= 0 && readout_s * frame_rate_hz <= 1))
    return "The readout time of a rolling shutter must be from 0 s to the time between two frames.";
  if (!(focal_error >= -0.5 && focal_error <= 1))
    return "The error of the calibrated focal length must be from -50 to 100 percent.";
  if (!(std::abs(distortion_error_px) <= 20))
    return "The error of the calibrated distortion must be from -20 to 20 pixels.";
  if (!(gain >= 0.05 && gain <= 20)) return "The gain must be from 0.05 to 20.";
  if (!(exposure_jump_stops >= 0 && exposure_jump_stops <= 4))
    return "The exposure jumps must be from 0 to 4 stops.";
  if (!(gain_noise_sigma >= 0 && gain_noise_sigma <= 50))
    return "The gain noise must be from 0 to 50 grey levels.";
  if (!(dropped_share >= 0 && dropped_share <= 0.9))
    return "The ratio of dropped frames must be from 0 to 90 percent.";
  if (!(tremor_deg >= 0 && tremor_deg <= 5)) return "The tremor must be from 0 to 5 degrees.";
  return std::nullopt;
}

}  // namespace docent::app
