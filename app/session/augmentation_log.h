// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "app/files/checked_file.h"
#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Writes where content was drawn: augmentations.csv, one line a frame and thing whose foot lies in the
// image, `timestamp,map,name,u,v` with the pixel of the foot. Against a truth it tells how well things stay
// where they were put. One thread.
class AugmentationLog {
 public:
  explicit AugmentationLog(const std::filesystem::path& folder);

  void Add(const engine::TrackedFrame& frame, const engine::CameraModel& camera, const std::string& map_name,
           const content::Scene& scene);
  void Close() { file_.Close(); }

 private:
  CheckedFile file_;
};

}  // namespace docent::app
