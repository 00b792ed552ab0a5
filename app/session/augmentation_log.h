// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "app/files/checked_file.h"
#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Logs where content is drawn, in augmentations.csv: one line for each frame and entity whose foot point
// projects into the image, `timestamp,map,name,u,v` with the pixel of the foot point. Compared with ground
// truth it measures how well content stays in place. One thread.
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
