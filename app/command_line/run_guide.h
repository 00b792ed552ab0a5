// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/command_line/options.h"
#include "app/script/commands.h"
#include "app/session/calibrated_camera.h"
#include "app/session/frame_loop.h"
#include "app/session/guided_view.h"
#include "maps/library.h"

// What authoring, touring and the demonstration share: one camera, or the two of a wearable, through a
// session over a library, seen in a window or not at all. The script and the director act for the first
// camera.
namespace docent::engine {
class PlanarTarget;
}

namespace docent::app {

struct GuideRequest {
  maps::Library* library = nullptr;
  bool may_write = false;
  Pace pace = Pace::kEager;
  EngineKind engine = EngineKind::kHybrid;
  bool headless = false;
  std::uint64_t seed = 1;
  std::size_t memory_budget_bytes = std::size_t{1} << 30;  // of maps in memory
  bool new_map_when_lost = false;                          // see SessionOptions
  Timestamp autosave_interval = SessionOptions().autosave_interval;
  std::optional<std::filesystem::path> output, record, record_script;
  std::vector<TimedCommand> script;
  std::string script_name;
  std::filesystem::path model_folder;
  std::string title;  // of the window
  // What is done of itself on seeing a frame, as if a person did it in the window; may be empty. On the
  // camera's thread.
  std::function<std::vector<Command>(const ShownFrame&)> director;
  double baseline_m = 0;                               // see SessionOptions
  std::shared_ptr<const engine::PlanarTarget> target;  // see engine::TrackerOptions; may be null
  std::optional<HeadPolicy> head;
  // Told of every frame on its camera's thread, one at a time; may be empty.
  std::function<void(const ShownFrame&)> on_frame;
  // Told of every drawn frame with its image, on the thread that draws; may be empty. Without a window
  // frames are drawn only for this and for `record`.
  std::function<void(const ShownFrame&, const cv::Mat&)> on_image;
};

// Runs until the first camera ends, the window is closed, or the person interrupts; saves and closes
// everything then, also when it ends by an Error. Answers with the maps as they were at the end.
std::vector<Session::MapState> RunGuide(const GuideRequest& request, std::span<CalibratedCamera> cameras,
                                        Verbosity verbosity);

// The cameras that the arguments name, clipped to --from and --until. Throws Error.
std::vector<CalibratedCamera> OpenArgumentCameras(const RunArguments& run);

}  // namespace docent::app
