// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::app {

// How one eye sees through a worn display: the eye and its display are a pinhole camera whose image is the
// display's.
struct DisplayEye {
  engine::CameraModel camera;      // Of the display's size.
  engine::Rigid3 eye_from_camera;  // From the camera that is tracked; metres.
};

// The two eyes of a worn display, left and right.
struct DisplayCalibration {
  std::array<DisplayEye, 2> eyes;
};

// Reads a display calibration (YAML), as a calibration of the display measures it:
//
//   width: 1280                  # pixels of each eye's display
//   height: 720
//   left: [fx, fy, cx, cy]       # pixels
//   right: [fx, fy, cx, cy]
//   left_position: [x, y, z]     # of the eye in the axes of the camera (x right, y down, z forward), metres
//   right_position: [x, y, z]
//   left_rotation: [x, y, z]     # of the eye against the camera: axis times angle, degrees; may be left out
//   right_rotation: [x, y, z]
//
// An eye may be turned by up to 360 degrees. Throws Error with one sentence, which names the file and the
// field.
DisplayCalibration ReadDisplayCalibration(const std::filesystem::path& file);
// The same from the text of a file; `name` is its name in error messages.
DisplayCalibration ParseDisplayCalibration(const std::string& text, const std::string& name);

}  // namespace docent::app
