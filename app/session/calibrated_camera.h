// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "app/cameras/frame_source.h"
#include "engine/geometry/camera_model.h"

namespace docent::app {

// An image source and the model of the lens that its images were taken with.
struct CalibratedCamera {
  std::unique_ptr<FrameSource> source;
  std::shared_ptr<const engine::CameraModel> model;
  std::string calibration_name;  // file or source, for error messages

  // Throws Error when the size of the image differs from that of the calibration.
  void CheckImage(const cv::Mat& image) const;
};

// Finds the camera model of a source: the given file, else the model that the source knows, else a
// calibration file beside its images. Throws Error with one sentence when there is none.
CalibratedCamera Calibrate(std::unique_ptr<FrameSource> source,
                           const std::optional<std::filesystem::path>& calibration);

}  // namespace docent::app
