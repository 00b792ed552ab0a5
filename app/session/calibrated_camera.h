// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/cameras/frame_source.h"
#include "engine/geometry/camera_model.h"
#include "engine/mapping/calibration/lens_estimation.h"
#include "maps/library/library.h"

namespace docent::app {

// An image source and the model of the lens that its images were taken with.
struct CalibratedCamera {
  std::unique_ptr<FrameSource> source;
  std::shared_ptr<const engine::CameraModel> model;
  std::string calibration_name;  // file or source, for error messages
  // The estimate of an unknown calibration, whose `model` is the current one; empty for a known calibration.
  std::optional<engine::EstimatedLens> estimated_lens = std::nullopt;

  // Throws Error when the size of the image differs from that of the calibration.
  void CheckImage(const cv::Mat& image) const;
};

// The argument of --calibration that requests estimation instead of naming a file.
inline constexpr const char* kEstimateCalibration = "auto";

// Finds the camera model of a source: the given file, else the model that the source knows, else a
// calibration file beside its images. If there is none, or if the argument is "auto", the calibration is
// estimated: the initial model then has the size of the first image and a field of view of
// engine::kUnknownFieldOfView_deg. The source still delivers that image afterwards. Throws Error with one
// sentence if a file or the first image cannot be read.
CalibratedCamera Calibrate(std::unique_ptr<FrameSource> source,
                           const std::optional<std::filesystem::path>& calibration);

// Starts from the estimates that the library has stored for cameras with this name and image size. Throws
// Error if they are damaged.
void LoadKnownLenses(const maps::Library& library, std::span<CalibratedCamera> cameras);

// The lenses of the cameras with an unknown calibration, for SessionOptions::mapper.lens.
std::vector<engine::EstimatedLens> EstimatedLensesOf(std::span<const CalibratedCamera> cameras);

}  // namespace docent::app
