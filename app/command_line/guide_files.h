// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "app/command_line/run_guide.h"
#include "app/files/checked_file.h"
#include "app/output/run_output.h"
#include "app/session/augmentation_log.h"
#include "app/session/guidance_log.h"

namespace docent::app {

// Text files that a guided run writes when they were requested: trajectory, frames, events, augmentations,
// guidance and recorded script. One thread at a time.
class GuideFiles {
 public:
  // `first_camera` projects the content that was drawn over the first camera's images into the log of
  // augmentations, unless a frame has a model of its own. Throws Error when a file cannot be created.
  GuideFiles(const GuideRequest& request, const engine::CameraModel& first_camera);

  void Add(const ShownFrame& frame);
  // Only the commands of the first camera can be repeated; those of others become comments of the script.
  void Add(const TimedCommand& command, std::size_t camera);
  void Add(const std::vector<Event>& events);
  void Close();

 private:
  const engine::CameraModel& camera_;
  std::optional<RunOutput> output_;
  std::optional<AugmentationLog> augmentations_;
  std::optional<GuidanceLog> guidance_;  // Only on a tour.
  std::optional<CheckedFile> script_;
};

}  // namespace docent::app
