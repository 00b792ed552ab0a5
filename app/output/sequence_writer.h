// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "app/files/checked_file.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::app {

enum class ImageFormat { kPng, kJpeg };

// One image of a sequence with its ground truth.
struct SequenceImage {
  Timestamp time{};
  cv::Mat image;  // CV_8UC3 (BGR) or CV_8UC1
  engine::Rigid3 truth_from_camera;
  std::string label;  // what the camera is doing, in one word; may be empty
};

// Writes an image sequence in the TUM RGB-D layout: rgb/, rgb.txt, groundtruth.txt, segments.txt and
// calibration.yaml. The lists get their names when Close is called, so a folder without rgb.txt is an
// unfinished sequence. One thread. Throws Error when a file cannot be written.
class SequenceWriter {
 public:
  SequenceWriter(const std::filesystem::path& folder, const engine::CameraModel& camera, ImageFormat format);
  void Add(const SequenceImage& image);
  void Close();

 private:
  std::filesystem::path folder_;
  ImageFormat format_;
  CheckedFile list_, truth_, segments_;
};

}  // namespace docent::app
