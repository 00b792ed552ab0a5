// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/options.h"
#include "app/script/commands.h"
#include "app/session/calibrated_camera.h"
#include "app/session/frame_loop.h"
#include "app/session/guided_view.h"
#include "maps/library.h"

// What authoring, touring and the demonstration share: one camera through a session over a library, seen in a
// window or not at all.
namespace docent::app {

struct GuideRequest {
  maps::Library* library = nullptr;
  bool may_write = false;
  Pace pace = Pace::kEager;
  bool headless = false;
  std::uint64_t seed = 1;
  std::size_t memory_budget_bytes = std::size_t{1} << 30;  // of maps in memory
  Timestamp autosave_interval = SessionOptions().autosave_interval;
  std::optional<std::filesystem::path> output, record, record_script;
  std::vector<TimedCommand> script;
  std::string script_name;
  std::filesystem::path model_folder;
  std::string title;  // of the window
  // What is done of itself on seeing a frame, as if a person did it in the window; may be empty. On the
  // camera's thread.
  std::function<std::vector<Command>(const ShownFrame&)> director;
  // Told of every frame on the camera's thread; may be empty.
  std::function<void(const ShownFrame&)> on_frame;
  // Told of every drawn frame with its picture, on the thread that draws; may be empty. Without a window
  // frames are drawn only for this and for `record`.
  std::function<void(const ShownFrame&, const cv::Mat&)> on_picture;
};

// Runs until the camera ends, the window is closed, or the person interrupts; saves and closes everything
// then, also when it ends by an Error. Answers with the maps as they were at the end.
std::vector<Session::MapState> RunGuide(const GuideRequest& request, CalibratedCamera* camera,
                                        Verbosity verbosity);

// The camera that the arguments name, clipped to --from and --until. Throws Error.
CalibratedCamera OpenArgumentCamera(const RunArguments& run);

}  // namespace docent::app
