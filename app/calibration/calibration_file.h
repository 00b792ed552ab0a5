// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/geometry/camera_model.h"

// Calibration files: Docent's own YAML, OpenCV's camera_matrix files, ROS camera_info (files and message
// dumps) and EuRoC's sensor.yaml. The format is recognized by the fields of the file.
// In each of them `rolling_shutter_ms` may state the time from the exposure of the first row to that of the
// last, milliseconds (0: a global shutter; negative: the last row is exposed first), and
// `rolling_shutter_columns_ms` that from the first column to the last, of a camera whose images are turned.
namespace docent::app {

// Reads a calibration. Throws Error with one sentence that names the file and the field when a field is
// missing, is not a number, or the values do not describe a valid camera.
engine::CameraModel ReadCalibration(const std::filesystem::path& path);
// Parses a calibration from text. `name` is the file's name in error messages.
engine::CameraModel ParseCalibration(const std::string& text, const std::string& name);

// Writes Docent's own YAML, from which ReadCalibration restores an equal model. Throws Error.
void WriteCalibration(const std::filesystem::path& path, const engine::CameraModel& camera);
// The text that WriteCalibration writes.
std::string FormatCalibration(const engine::CameraModel& camera);

// Finds the calibration in a sequence folder: calibration.yaml, camera.yaml, camera_info.yaml, or the
// sensor.yaml of an EuRoC camera. Empty when there is none.
std::optional<std::filesystem::path> FindCalibration(const std::filesystem::path& folder);

// Throws Error when the image size differs from that of the calibration. `source` and `calibration` are the
// names in the error message.
void CheckImageSize(const engine::CameraModel& camera, int width_px, int height_px, const std::string& source,
                    const std::string& calibration);

}  // namespace docent::app
