// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "app/cameras/frame_source.h"
#include "engine/geometry/camera_model.h"

namespace docent::app {

// Images and the lens that they were taken through.
struct CalibratedCamera {
  std::unique_ptr<FrameSource> source;
  std::shared_ptr<const engine::CameraModel> model;
  std::string calibration_name;  // for sentences

  // Throws Error when an image's size is not the calibration's.
  void CheckImage(const cv::Mat& image) const;
};

// Finds the lens of a source: the file that was named, else what the source knows or what lies beside its
// images. Throws Error with one sentence when there is none.
CalibratedCamera Calibrate(std::unique_ptr<FrameSource> source,
                           const std::optional<std::filesystem::path>& calibration);

}  // namespace docent::app
