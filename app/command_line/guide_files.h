// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "app/command_line/run_guide.h"
#include "app/files/checked_file.h"
#include "app/output/run_output.h"
#include "app/session/augmentation_log.h"

namespace docent::app {

// The text files that a guided run leaves, where they were asked for. One thread at a time.
class GuideFiles {
 public:
  // What was drawn over the first camera's images is noted through its lens.
  GuideFiles(const GuideRequest& request, const engine::CameraModel& first_camera);

  void Add(const ShownFrame& frame);
  void Add(const TimedCommand& command);
  void Add(const std::vector<Event>& events);
  void Close();

 private:
  const engine::CameraModel& camera_;
  std::optional<RunOutput> output_;
  std::optional<AugmentationLog> augmentations_;
  std::optional<CheckedFile> script_;
};

}  // namespace docent::app
