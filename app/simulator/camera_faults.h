// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace docent::app {

// Imperfections of real cameras and their calibrations. Every fault is off by default and then does not
// change any byte of the simulation. Timestamps and ground truth stay exact: a calibration error affects the
// calibration file of the sequence and not the lens, and hand tremor is part of the true pose. The seed of
// the simulation determines the affected frames.
struct CameraFaults {
  // Rolling shutter: time from the exposure of the first row to that of the last, in seconds. Timestamp and
  // true pose of an image are those of the middle row. Eight phones took 28 to 61 ms (Ringaby and Forssen
  // 2012, "Efficient video rectification and stabilisation for cell-phones").
  double readout_s = 0;
  // Interlacing: odd rows are exposed half a frame later than even rows, to which the timestamp belongs.
  bool interlaced = false;

  double focal_error = 0;          // Relative error of the calibrated focal length; 0.01: 1 % too long.
  double distortion_error_px = 0;  // RMS displacement of rays over the image by the calibrated distortion;
                                   // negative: the first coefficient of the calibration is too small.

  double gain = 1;                 // Factor of the exposure; above 1, highlights are clipped at 255.
  double exposure_jump_stops = 0;  // Largest jump of the exposure (see ExposureJumps); one stop doubles it.
  double gain_noise_sigma = 0;  // Standard deviation of the noise at a signal of 128 grey levels and gain 1;
                                // the variance grows with signal and gain (photon noise, EMVA 1288).
  double dropped_share = 0;     // Ratio of frames that are lost (see KeptFrames), in [0, 0.9].
  double tremor_deg = 0;        // RMS rotation of the hand tremor about each axis (see Tremor).

  // Describes the first invalid value in one sentence, or empty.
  std::optional<std::string> Validate(double frame_rate_hz) const;
};

}  // namespace docent::app
