// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/camera_faults.h"

#include <cmath>

namespace docent::app {

std::optional<std::string> CameraFaults::Validate(double frame_rate_hz) const {
  // Written so that a number that is not one fails too.
  if (!(readout_s >= 0 && readout_s * frame_rate_hz <= 1))
    return "The readout of a rolling shutter lies from 0 s to the time between two frames.";
  if (!(focal_error >= -0.5 && focal_error <= 1))
    return "The error of the calibrated focal length lies from -50 to 100 per cent.";
  if (!(std::abs(distortion_error_px) <= 20))
    return "The error of the calibrated distortion lies from -20 to 20 pixels.";
  if (!(gain >= 0.05 && gain <= 20)) return "The gain of a simulation lies from 0.05 to 20.";
  if (!(exposure_jump_stops >= 0 && exposure_jump_stops <= 4))
    return "The exposure of a simulation jumps by 0 to 4 stops.";
  if (!(gain_noise_sigma >= 0 && gain_noise_sigma <= 50))
    return "The gain noise of a simulation lies from 0 to 50 grey levels.";
  if (!(dropped_share >= 0 && dropped_share <= 0.9))
    return "A simulation drops 0 to 90 per cent of its frames.";
  if (!(tremor_deg >= 0 && tremor_deg <= 5)) return "The tremor of a simulation lies from 0 to 5 degrees.";
  return std::nullopt;
}

}  // namespace docent::app
