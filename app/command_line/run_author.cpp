// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "app/cameras/decode_image.h"
#include "app/command_line/run_guide.h"
#include "app/command_line/runs.h"
#include "app/script/script_file.h"
#include "engine/base/error.h"
#include "engine/mapping/planar_target.h"

namespace docent::app {

namespace {

bool AnyLive(const std::vector<CalibratedCamera>& cameras) {
  return std::any_of(cameras.begin(), cameras.end(),
                     [](const CalibratedCamera& camera) { return camera.source->info().live; });
}

// What both ways of guiding are told alike.
void TakeOver(const RunArguments& run, bool any_live, GuideRequest* request) {
  request->pace = ResolvePace(run, any_live);
  request->engine = run.engine;
  request->baseline_m = run.baseline_m;
  request->head = run.head;
  request->headless = run.headless;
  request->seed = run.seed;
  request->memory_budget_bytes = run.memory_budget_bytes;
  request->output = run.output;
  request->record = run.record;
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

}  // namespace

void RunAuthor(const AuthorOptions& options, Verbosity verbosity) {
  GuideRequest request;
  request.may_write = true;
  request.title = "Docent - author";
  if (options.script) {
    request.script = ReadScript(*options.script);
    request.script_name = options.script->string();
    request.model_folder = options.script->parent_path();
  }
  const WhenLost otherwise = options.run.headless ? WhenLost::kNew : WhenLost::kWait;
  request.new_map_when_lost = options.when_lost.value_or(otherwise) == WhenLost::kNew;
  if (options.target) request.target = ReadTarget(*options.target, options.target_width_m);
  std::vector<CalibratedCamera> cameras = OpenArgumentCameras(options.run);
  maps::Library library =
      maps::Library::Open(options.library, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  request.library = &library;
  TakeOver(options.run, AnyLive(cameras), &request);
  request.autosave_interval = options.autosave_interval;
  request.record_script = options.record_script;
  const auto maps = RunGuide(request, cameras, verbosity);
  if (verbosity == Verbosity::kQuiet) return;
  for (const Session::MapState& map : maps) {
    if (map.discarded || map.joined_into != 0 || !map.snapshot) continue;
    std::printf("%s: %zu keyframes, %zu points, %zu things\n", map.name.c_str(),
                map.snapshot->keyframes.size(), map.snapshot->points.size(), map.scene->entities.size());
  }
}

void RunTour(const TourOptions& options, Verbosity verbosity) {
  std::vector<CalibratedCamera> cameras = OpenArgumentCameras(options.run);
  maps::Library library = maps::Library::Open(options.library, maps::Access::kReadOnly);
  GuideRequest request;
  request.library = &library;
  request.title = "Docent - tour";
  TakeOver(options.run, AnyLive(cameras), &request);
  std::uint64_t frames = 0, named = 0;
  request.on_frame = [&](const ShownFrame& frame) {
    ++frames;
    if (engine::HasPose(frame.tracked.state)) ++named;
  };
  RunGuide(request, cameras, verbosity);
  if (verbosity == Verbosity::kQuiet) return;
  std::printf("%llu of %llu frames with a pose in one of %zu maps\n", static_cast<unsigned long long>(named),
              static_cast<unsigned long long>(frames), library.List().size());
}

}  // namespace docent::app
