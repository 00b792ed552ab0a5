// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace docent::app {

// What real cameras and their calibrations do that an ideal one does not. Every fault is off by default, and
// then the simulation is the same to the byte as without it. Timestamps and ground truth stay true: a
// calibration error is in the calibration that comes with the sequence, not in the lens, and a hand's tremor
// is part of the true pose. Which frame suffers follows from the seed of the simulation.
struct CameraFaults {
  // Time from the exposure of the first row to that of the last, seconds. The image's time, and its true
  // pose, are those of the row in the middle. Eight phones took 28 to 61 ms (Ringaby and Forssen 2012,
  // "Efficient video rectification and stabilisation for cell-phones").
  double readout_s = 0;
  // Interlacing: the odd rows are exposed half a frame later than the even ones, to which the time belongs.
  bool interlaced = false;

  double focal_error = 0;  // the calibration's focal length is too long by this part of it; 0.01: 1 %
  double distortion_error_px =
      0;  // root mean square over the image of where the calibration's distortion misplaces
          // a ray; negative: the calibration's first coefficient is too small

  double gain = 1;                 // of the whole exposure; above 1 highlights are clipped at 255
  double exposure_jump_stops = 0;  // largest jump of the exposure (ExposureJumps); one stop doubles it
  double gain_noise_sigma = 0;  // standard deviation of the noise of a signal of 128 grey levels at gain 1;
                                // its variance grows with the signal and the gain (photon noise, EMVA 1288)
  double dropped_share = 0;     // of the frames that are lost on the way (KeptFrames), [0, 0.9]
  double tremor_deg = 0;        // root mean square rotation of the hand's tremor about each axis (Tremor)

  // A sentence that says what is wrong with these faults, or empty.
  std::optional<std::string> Validate(double frame_rate_hz) const;
};

}  // namespace docent::app
