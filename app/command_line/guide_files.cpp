// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_files.h"

#include "app/script/format_command.h"
#include "engine/base/error.h"

namespace docent::app {

GuideFiles::GuideFiles(const GuideRequest& request, const engine::CameraModel& first_camera)
    : camera_(first_camera) {
  try {
    Open(request);
  } catch (const Error& error) {
    // A kiosk that starts again on a full disk must not fail for ever.
    if (request.kiosk_code.empty()) throw;
    output_.reset();
    augmentations_.reset();
    guidance_.reset();
    script_.reset();
    HandleFailure(error.what() + std::string(" No files are written."));
  }
}

void GuideFiles::Open(const GuideRequest& request) {
  if (request.output) {
    for (const char* name : {"frames.csv", "events.csv", "trajectory.txt", "trajectory_1.txt",
                             "augmentations.csv", "guidance.csv"})
      KeepUnfinished(*request.output / name);
    output_.emplace(*request.output);
    augmentations_.emplace(*request.output);
    if (!request.may_write) guidance_.emplace(*request.output);
  }
  if (request.record_script) {
    KeepUnfinished(*request.record_script);
    script_.emplace(*request.record_script);
  }
}

template <typename Action>
void GuideFiles::WriteOutput(const Action& action) {
  if (!output_) return;
  try {
    action();
  } catch (const Error& error) {
    output_.reset();
    augmentations_.reset();
    guidance_.reset();
    HandleFailure(error.what() + std::string(" The files of --output end here."));
  }
}

template <typename Action>
void GuideFiles::WriteScript(const Action& action) {
  if (!script_) return;
  try {
    action();
  } catch (const Error& error) {
    script_.reset();
    HandleFailure(error.what() + std::string(" The recorded script ends here."));
  }
}

void GuideFiles::HandleFailure(const std::string& problem) {
  if (!problem_.empty()) problem_ += ' ';
  problem_ += problem;
  if (!failures_.empty()) failures_ += ' ';
  failures_ += problem;
}

void GuideFiles::Add(const ShownFrame& frame) {
  WriteOutput([&] {
    output_->Add(frame.tracked, frame.shown.map_name);
    if (frame.shown.scene && frame.tracked.frame.camera == 0)
      augmentations_->Add(frame.tracked, frame.camera ? *frame.camera : camera_, frame.shown.map_name,
                          *frame.shown.scene);
    if (guidance_ && frame.way) guidance_->Add(frame.tracked, frame.shown.map_name, *frame.way);
  });
}

void GuideFiles::Add(const TimedCommand& command, std::size_t camera) {
  WriteScript([&] {
    const std::string prefix = camera == 0 ? "" : "# camera " + std::to_string(camera + 1) + ": ";
    script_->Write(prefix + FormatScriptLine(command) + '\n');
  });
}

void GuideFiles::Add(const std::vector<Event>& events) {
  WriteOutput([&] {
    for (const Event& event : events) output_->Add(event);
  });
}

void GuideFiles::Close() {
  WriteOutput([&] {
    output_->Close();
    augmentations_->Close();
    if (guidance_) guidance_->Close();
  });
  WriteScript([&] { script_->Close(); });
  if (!failures_.empty()) throw Error(failures_);
}

}  // namespace docent::app
