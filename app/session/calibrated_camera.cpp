// SPDX-License-Identifier: Apache-2.0
#include "app/session/calibrated_camera.h"

#include <utility>

#include "app/calibration/calibration_file.h"
#include "engine/base/error.h"

namespace docent::app {

void CalibratedCamera::CheckImage(const cv::Mat& image) const {
  CheckImageSize(*model, image.cols, image.rows, source->info().name, calibration_name);
}

CalibratedCamera Calibrate(std::unique_ptr<FrameSource> source,
                           const std::optional<std::filesystem::path>& calibration) {
  CalibratedCamera camera;
  const SourceInfo& info = source->info();
  if (calibration || (!info.known_camera && info.calibration_path)) {
    const std::filesystem::path path = calibration ? *calibration : *info.calibration_path;
    camera.model = std::make_shared<engine::CameraModel>(ReadCalibration(path));
    camera.calibration_name = path.string();
  } else if (info.known_camera) {
    camera.model = std::make_shared<engine::CameraModel>(*info.known_camera);
    camera.calibration_name = info.name;
  } else {
    throw Error("There is no calibration for '" + info.name + "'; give one with --calibration FILE.");
  }
  camera.source = std::move(source);
  return camera;
}

}  // namespace docent::app
