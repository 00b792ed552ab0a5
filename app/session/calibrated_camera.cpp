// SPDX-License-Identifier: Apache-2.0
#include "app/session/calibrated_camera.h"

#include <algorithm>
#include <utility>

#include "app/calibration/calibration_file.h"
#include "app/cameras/source_with_size.h"
#include "engine/base/error.h"

namespace docent::app {

void CalibratedCamera::CheckImage(const cv::Mat& image) const {
  CheckImageSize(*model, image.cols, image.rows, source->info().name, calibration_name);
}

namespace {

CalibratedCamera WithUnknownLens(std::unique_ptr<FrameSource> source) {
  CalibratedCamera camera;
  SourceWithSize sized = ReadSize(std::move(source));
  camera.source = std::move(sized.source);
  camera.model = std::make_shared<engine::CameraModel>(
      engine::LensWithFieldOfView(sized.size.width, sized.size.height, engine::kUnknownFieldOfView_deg));
  camera.calibration_name = camera.source->info().name;
  // The library stores the estimate under this name.
  camera.estimated_lens = {.model = camera.model,
                           .name = camera.calibration_name.substr(0, maps::kMaxCameraNameBytes)};
  return camera;
}

}  // namespace

void LoadKnownLenses(const maps::Library& library, std::span<CalibratedCamera> cameras) {
  const auto is_unknown = [](const CalibratedCamera& camera) { return camera.estimated_lens.has_value(); };
  if (std::none_of(cameras.begin(), cameras.end(), is_unknown)) return;
  for (const maps::StoredLens& known : library.Lenses()) {
    for (CalibratedCamera& camera : cameras) {
      if (!camera.estimated_lens || camera.estimated_lens->name != known.camera ||
          known.model.width_px() != camera.model->width_px() ||
          known.model.height_px() != camera.model->height_px())
        continue;
      camera.model = std::make_shared<engine::CameraModel>(known.model);
      camera.estimated_lens->model = camera.model;
      camera.estimated_lens->focal_sigma = known.focal_sigma;
      camera.estimated_lens->fixed = known.fixed;
    }
  }
}

std::vector<engine::EstimatedLens> EstimatedLensesOf(std::span<const CalibratedCamera> cameras) {
  std::vector<engine::EstimatedLens> lenses;
  for (const CalibratedCamera& camera : cameras) {
    if (camera.estimated_lens) lenses.push_back(*camera.estimated_lens);
  }
  return lenses;
}

CalibratedCamera Calibrate(std::unique_ptr<FrameSource> source,
                           const std::optional<std::filesystem::path>& calibration) {
  if (calibration && *calibration == kEstimateCalibration) return WithUnknownLens(std::move(source));
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
    return WithUnknownLens(std::move(source));
  }
  camera.source = std::move(source);
  return camera;
}

}  // namespace docent::app
