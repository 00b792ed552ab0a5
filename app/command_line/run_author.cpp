// SPDX-License-Identifier: Apache-2.0
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "app/cameras/decode_image.h"
#include "app/command_line/kiosk.h"
#include "app/command_line/run_arguments.h"
#include "app/command_line/run_guide.h"
#include "app/command_line/runs.h"
#include "app/files/write_confinement.h"
#include "app/script/script_file.h"
#include "app/session/library_scene.h"
#include "app/session/tour_route.h"
#include "engine/base/error.h"
#include "engine/initialization/planar_target.h"
#include "maps/hub/hub_connection.h"
#include "maps/library/session_lock.h"

namespace docent::app {

namespace {

bool AnyLive(const std::vector<CalibratedCamera>& cameras) {
  return std::any_of(cameras.begin(), cameras.end(),
                     [](const CalibratedCamera& camera) { return camera.source->info().live; });
}

// Copies the options that authoring and touring share.
void CopyRunArguments(const RunArguments& run, bool any_live, GuideRequest* request) {
  request->pace = ResolvePace(run, any_live);
  request->engine = run.engine;
  request->baseline_m = run.baseline_m;
  request->head = run.head;
  request->headless = run.headless;
  request->seed = run.seed;
  request->memory_budget_bytes = run.memory_budget_bytes;
  request->occlusion = run.occlusion;
  request->room_light = run.room_light;
  request->output = run.output;
  request->record = run.record;
  request->sound = run.sound.value_or(!run.headless);
  request->language = run.language ? *run.language : LanguageOfEnvironment();
}

// Throws Error if the library has no such tour, or the tour has no stops.
maps::Tour FindTour(const maps::Library& library, const std::string& name) {
  std::vector<std::string> damaged;
  for (const maps::Tour& tour : library.Tours(&damaged)) {
    if (tour.name != name) continue;
    if (!tour.stops.empty()) return tour;
    throw Error("The tour '" + name + "' has no stops; add some with docent maps tour edit.");
  }
  throw Error("'" + library.file() + "' has no tour named '" + name + "'.");
}

void ReadScriptFor(const std::filesystem::path& path, GuideRequest* request) {
  request->script = ReadScript(path);
  request->script_name = path.string();
  request->model_folder = path.parent_path();
}

std::shared_ptr<const engine::PlanarTarget> ReadTarget(const std::filesystem::path& path, double width_m) {
  std::vector<std::uint8_t> bytes;
  cv::Mat image = ReadImage(path, &bytes);
  if (image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
  try {
    return std::make_shared<engine::PlanarTarget>(image, width_m);
  } catch (const Error& error) {
    throw Error("'" + path.string() + "': " + error.what());
  }
}

// What a tour follows. A device without a library gets it now; later the network may be gone.
maps::SyncOptions FollowedHub(const TourOptions& options) {
  maps::SyncOptions hub = SyncOptionsOf(options.hub, options.library);
  std::error_code error;
  if (!std::filesystem::exists(options.library, error)) maps::Pull(hub);
  return hub;
}

// The hub of an author, whose library gets what others have changed, because nothing replaces its maps while
// the session lasts.
maps::SyncOptions PulledHub(const AuthorOptions& options) {
  maps::SyncOptions hub = SyncOptionsOf(options.hub, options.library);
  hub.remove = options.library_is_copy;
  try {
    for (const std::string& line : maps::Pull(hub).lines) spdlog::info("{}", line);
  } catch (const maps::HubUnreachable& unreachable) {
    spdlog::warn("{}; the session continues with the maps in the library.", unreachable.what());
  }
  return hub;
}

// A tour reads files of others and needs to write to little.
void ConfineTour(const TourOptions& options) {
  std::vector<std::filesystem::path> folders = SystemFolders();
  // A library that an author has open, and one that follows a hub, have files beside them.
  for (const auto& file :
       {std::optional(options.library), options.run.output, options.run.record, options.log}) {
    if (file) folders.push_back(ExistingFolderOf(*file));
  }
  ConfineWritesTo(folders);
}

}  // namespace

void RunAuthor(const AuthorOptions& options, Verbosity verbosity) {
  GuideRequest request;
  request.may_write = true;
  request.title = "Docent - author";
  if (options.script) ReadScriptFor(*options.script, &request);
  const WhenLost otherwise = options.run.headless ? WhenLost::kNew : WhenLost::kWait;
  // A script has its own times, and a map that starts by itself needs no one to wait for.
  request.stays_at_last = !options.run.headless;
  request.waits_at_first = !options.run.headless && !options.script && !options.when_lost;
  request.new_map_when_lost = options.when_lost.value_or(otherwise) == WhenLost::kNew;
  if (options.target) request.target = ReadTarget(*options.target, options.target_width_m);
  std::vector<CalibratedCamera> cameras = OpenArgumentCameras(options.run);
  for (const CalibratedCamera& camera : cameras)
    CheckStorableSize(*camera.model, "'" + camera.source->info().name + "'");
  if (!options.hub.empty()) request.hub = PulledHub(options);
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kSession);
  request.library = &library;
  CopyRunArguments(options.run, AnyLive(cameras), &request);
  request.autosave_interval = options.autosave_interval;
  request.record_script = options.record_script;
  request.ui_scale = options.ui_scale;
  const auto maps = RunGuide(request, cameras, verbosity);
  if (verbosity == Verbosity::kQuiet) return;
  for (const Session::MapState& map : maps) {
    if (map.discarded || map.joined_into != 0 || !map.snapshot) continue;
    const std::size_t objects = map.scene->entities.size();
    std::printf("%s: %zu keyframes, %zu points, %zu %s\n", map.name.c_str(), map.snapshot->keyframes.size(),
                map.snapshot->points.size(), objects, objects == 1 ? "object" : "objects");
  }
}

void RunTour(const TourOptions& options, Verbosity verbosity) {
  GuideRequest request;
  if (options.kiosk) {
    request.kiosk_code = ReadKioskCode(*options.kiosk);
    if (options.run.headless) throw Error("A kiosk needs its window; remove --headless.");
    if (!RestartAfterFailures()) return;
  }
  ConfineTour(options);
  if (options.script) ReadScriptFor(*options.script, &request);
  std::vector<CalibratedCamera> cameras = OpenArgumentCameras(options.run);
  if (!options.hub.empty()) request.hub = FollowedHub(options);
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadOnly);
  request.library = &library;
  request.title = "Docent - tour";
  CopyRunArguments(options.run, AnyLive(cameras), &request);
  request.narrate = options.narrate;
  request.gaze = options.gaze;
  if (options.glasses) request.display = ReadDisplayCalibration(*options.display);
  request.visit_log = options.log;
  if (options.tour) {
    const maps::Tour tour = FindTour(library, *options.tour);
    request.route = RouteOf(library, tour);
    request.tour = tour.name;
    if (!options.run.language && !tour.language.empty()) request.language = tour.language;
  }
  std::uint64_t frames = 0, localized = 0;
  request.on_frame = [&](const ShownFrame& frame, const engine::MapperTimes&) {
    ++frames;
    if (engine::HasPose(frame.tracked.state)) ++localized;
  };
  RunGuide(request, cameras, verbosity);
  if (verbosity == Verbosity::kQuiet) return;
  const std::size_t maps = library.List().size();
  std::printf("%llu of %llu images have a pose; the library has %zu %s\n",
              static_cast<unsigned long long>(localized), static_cast<unsigned long long>(frames), maps,
              maps == 1 ? "map" : "maps");
}

}  // namespace docent::app
