// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_files.h"

#include "app/script/format_command.h"

namespace docent::app {

GuideFiles::GuideFiles(const GuideRequest& request, const engine::CameraModel& first_camera)
    : camera_(first_camera) {
  if (request.output) {
    output_.emplace(*request.output);
    augmentations_.emplace(*request.output);
    if (!request.may_write) guidance_.emplace(*request.output);
  }
  if (request.record_script) script_.emplace(*request.record_script);
}

void GuideFiles::Add(const ShownFrame& frame) {
  if (!output_) return;
  output_->Add(frame.tracked, frame.shown.map_name);
  if (frame.shown.scene && frame.tracked.frame.camera == 0)
    augmentations_->Add(frame.tracked, frame.camera ? *frame.camera : camera_, frame.shown.map_name,
                        *frame.shown.scene);
  if (guidance_ && frame.way) guidance_->Add(frame.tracked, frame.shown.map_name, *frame.way);
}

void GuideFiles::Add(const TimedCommand& command, std::size_t camera) {
  if (!script_) return;
  const std::string prefix = camera == 0 ? "" : "# camera " + std::to_string(camera + 1) + ": ";
  script_->Write(prefix + FormatScriptLine(command) + '\n');
}

void GuideFiles::Add(const std::vector<Event>& events) {
  if (!output_) return;
  for (const Event& event : events) output_->Add(event);
}

void GuideFiles::Close() {
  if (output_) output_->Close();
  if (augmentations_) augmentations_->Close();
  if (guidance_) guidance_->Close();
  if (script_) script_->Close();
}

}  // namespace docent::app
