// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/calibration/display_file.h"
#include "app/command_line/options.h"
#include "app/script/commands.h"
#include "app/session/calibrated_camera.h"
#include "app/session/frame_loop.h"
#include "app/session/guided_view.h"
#include "app/session/route_state.h"
#include "engine/mapping/mapper_output.h"
#include "maps/hub/sync.h"
#include "maps/library/library.h"

// Common part of authoring, touring and the demonstration: feeds one camera, or the two of a wearable,
// through a session that uses a library, with or without a window. Commands of the script and the director
// apply to the first camera.
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
  std::size_t memory_budget_bytes = std::size_t{1} << 30;  // For maps in memory.
  bool new_map_when_lost = false;                          // See SessionOptions.
  Timestamp autosave_interval = SessionOptions().autosave_interval;
  std::optional<std::filesystem::path> output, record, record_script;
  std::vector<TimedCommand> script;
  std::string script_name;
  std::filesystem::path model_folder;
  std::string title;   // Title of the window.
  bool sound = false;  // Sounds are heard, not only their captions shown.
  // Shows the content on black through this worn display instead of the camera's image; only without
  // may_write.
  std::optional<DisplayCalibration> display;
  bool gaze = false;     // Cards open for what visitors look at; only without may_write.
  bool narrate = false;  // What visitors are told and can read is spoken; only without may_write.
  std::string language;  // In which texts are shown that have it; see content::TextFor.
  double ui_scale = 1;   // Of the author's panel and texts, times what the monitor suggests.
  // In the window of an author with recordings: they wait at the first image until the person starts or
  // chooses a map or lets them go on, and their last image stays until the window is closed.
  bool waits_at_first = false, stays_at_last = false;
  // Returns commands to run for a frame, as if a person had given them in the window; may be empty. Called on
  // the camera's thread.
  std::function<std::vector<Command>(const ShownFrame&)> director;
  std::optional<std::filesystem::path>
      visit_log;               // Folder for the records of visits; only without may_write.
  std::string kiosk_code;      // Ends the window of a kiosk; empty for other tours. See KioskLock.
  std::string tour;            // The name of the tour below; empty for none.
  std::optional<Route> route;  // Of the tour that visitors are led along; only without may_write.
  // The library follows this hub; with may_write, the hub gets what is saved in the library.
  std::optional<maps::SyncOptions> hub;
  double baseline_m = 0;                               // See SessionOptions.
  Occlusion occlusion = Occlusion::kMap;               // See SessionOptions.
  bool room_light = true;                              // See SessionOptions.
  std::shared_ptr<const engine::PlanarTarget> target;  // See engine::TrackerOptions; may be null.
  std::optional<HeadPolicy> head;
  // Called with each frame, and with the time that mapping has taken since the beginning, on the camera's
  // thread, never concurrently; may be empty.
  std::function<void(const ShownFrame&, const engine::MapperTimes&)> on_frame;
  // Called with each drawn frame and its image on the drawing thread; may be empty. Without a window, frames
  // are drawn only for this and for `record`.
  std::function<void(const ShownFrame&, const cv::Mat&)> on_image;
};

// Runs until the first camera ends, the window is closed, or the program is interrupted. Saves and closes
// everything then, also when it ends with an Error. Returns the maps at the end.
std::vector<Session::MapState> RunGuide(const GuideRequest& request, std::span<CalibratedCamera> cameras,
                                        Verbosity verbosity);

// Opens the cameras named by the arguments, clipped to --from and --until. Throws Error.
std::vector<CalibratedCamera> OpenArgumentCameras(const RunArguments& run);

}  // namespace docent::app
