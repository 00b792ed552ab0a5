// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line/run_guide.h"
#include "app/files/checked_file.h"
#include "app/output/run_output.h"
#include "app/session/augmentation_log.h"
#include "app/session/guidance_log.h"

namespace docent::app {

// Text files that a guided run writes when they were requested: trajectory, frames, events, augmentations,
// guidance and recorded script. When one cannot be written, as on a full disk, the files of its option keep
// what they have under their temporary names, and the run goes on. One thread at a time.
class GuideFiles {
 public:
  // `first_camera` projects the content that was drawn over the first camera's images into the log of
  // augmentations, unless a frame has a model of its own. What a crashed run left unfinished is kept under
  // another name. Throws Error when a file cannot be created, except in a kiosk, where TakeProblem says so.
  GuideFiles(const GuideRequest& request, const engine::CameraModel& first_camera);

  void Add(const ShownFrame& frame);
  // Only the commands of the first camera can be repeated; those of others become comments of the script.
  void Add(const TimedCommand& command, std::size_t camera);
  void Add(const std::vector<Event>& events);
  // Why files end before the run, as a sentence, once; empty otherwise.
  std::string TakeProblem() { return std::exchange(problem_, {}); }
  // Throws Error when a file is incomplete, also if TakeProblem has said so.
  void Close();

 private:
  void Open(const GuideRequest& request);
  template <typename Action>
  void WriteOutput(const Action& action);
  template <typename Action>
  void WriteScript(const Action& action);
  void HandleFailure(const std::string& problem);

  const engine::CameraModel& camera_;
  std::optional<RunOutput> output_;
  std::optional<AugmentationLog> augmentations_;
  std::optional<GuidanceLog> guidance_;  // Only on a tour.
  std::optional<CheckedFile> script_;
  std::string problem_;
  std::string failures_;  // All problems; empty if there was none.
};

}  // namespace docent::app
