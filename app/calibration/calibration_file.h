// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/geometry/camera_model.h"

// Calibration files of every kind that command-line.md names: Docent's own YAML, OpenCV's camera_matrix
// files, ROS camera_info (files and message dumps) and EuRoC's sensor.yaml. Which kind a file is shows in its
// fields.
namespace docent::app {

// Throws Error with one sentence that names file and field when something is missing, not a number, or does
// not make a camera.
engine::CameraModel ReadCalibration(const std::filesystem::path& path);
// The same from text; `name` stands in the sentences.
engine::CameraModel ParseCalibration(const std::string& text, const std::string& name);

// Writes Docent's own YAML; ReadCalibration gives an equal model back. Throws Error.
void WriteCalibration(const std::filesystem::path& path, const engine::CameraModel& camera);
std::string FormatCalibration(const engine::CameraModel& camera);

// The calibration that lies in a sequence folder: calibration.yaml, camera.yaml, camera_info.yaml, or the
// sensor.yaml of an EuRoC camera. Empty when there is none.
std::optional<std::filesystem::path> FindCalibration(const std::filesystem::path& folder);

// Throws Error when images of this size do not belong to the calibration; `source` and `calibration` are
// names for the sentence.
void CheckImageSize(const engine::CameraModel& camera, int width_px, int height_px, const std::string& source,
                    const std::string& calibration);

}  // namespace docent::app
