// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <system_error>
#include <utility>

#include "app/cameras/clipped_source.h"
#include "app/cameras/simulated_source.h"
#include "app/command_line/evaluate_sequence.h"
#include "app/command_line/interruption.h"
#include "app/command_line/map_panel.h"
#include "app/command_line/run_guide.h"
#include "app/command_line/runs.h"
#include "app/demo/exhibit_model.h"
#include "app/demo/museum_director.h"
#include "app/evaluation/html_report.h"
#include "app/evaluation/json_report.h"
#include "app/evaluation/simulated_truth.h"
#include "app/files/text_file.h"
#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "maps/library/session_lock.h"
#include "ui/context.h"
#include "ui/map_view.h"

namespace docent::app {

namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = "museum:3";
constexpr const char* kModelFile = "exhibit.glb";

fs::path OutputFolder(const DemoOptions& options) {
  if (options.output) {
    MakeFolder(*options.output);
    return *options.output;
  }
  std::string pattern = (fs::temp_directory_path() / "docent-demo-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw Error("Cannot create a folder '" + pattern + "'.");
  return pattern;
}

void WriteModel(const fs::path& path) {
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  CheckedFile file(path);
  file.Write(std::string_view(reinterpret_cast<const char*>(glb.data()), glb.size()));
  file.Close();
}

void WriteImage(const fs::path& path, const cv::Mat& image) {
  if (!cv::imwrite(path.string(), image)) throw Error("Cannot write '" + path.string() + "'.");
}

fs::path ScriptIn(const fs::path& folder) {
  return folder / "author" / "script.txt";
}

// Throws Error for a library that no earlier demonstration in this folder has made.
void CheckLibrary(const fs::path& library, const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(library, error)) return;
  const fs::path script = ScriptIn(folder);
  // The name ends in .part if the demonstration was interrupted.
  const bool has_script = fs::exists(script, error) || fs::exists(script.string() + ".part", error);
  if (has_script && fs::exists(folder / kModelFile, error)) return;
  throw Error("'" + library.string() +
              "' already exists and is not of an earlier demonstration; give another folder with --output.");
}

// Makes a map's name usable in a file name: "Bay 3" becomes "Bay-3".
std::string FileName(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ' ' || c == '/'; }, '-');
  return name;
}

// One half of the demonstration: a part of the simulated trajectory, with its record for the report.
class DemoRun {
 public:
  DemoRun(std::shared_ptr<const Simulation> simulation, int first_frame, int end_frame, std::string name)
      : simulation_(std::move(simulation)), first_frame_(first_frame), end_frame_(end_frame) {
    run_.run.name = std::move(name);
  }

  // Throws Error if the program was interrupted.
  void Run(GuideRequest request, Verbosity verbosity) {
    const auto start = std::chrono::steady_clock::now();
    RunRecorder recorder;
    request.on_frame = [&, next = std::move(request.on_frame)](const ShownFrame& frame,
                                                               const engine::MapperTimes& mapping) {
      recorder.Add(frame.tracked, MakeMappingTimes(mapping));
      if (next) next(frame, mapping);
    };
    const Timestamp begin = simulation_->time(0);
    auto source = OpenSimulation(simulation_);
    const Timestamp until =
        end_frame_ < simulation_->frame_count() ? simulation_->time(end_frame_) - begin : Timestamp{};
    CalibratedCamera camera = Calibrate(
        ClipSource(std::move(source), simulation_->time(first_frame_) - begin, until), std::nullopt);
    maps_ = RunGuide(request, {&camera, 1}, verbosity);
    if (Interruption::requested()) throw Error("Interrupted; the demonstration is incomplete.");
    run_.run.engine = ToString(request.engine);
    run_.run.frames = recorder.frames();
    if (!run_.run.frames.empty()) run_.run.mapping = run_.run.frames.back().mapping;
    for (const Session::MapState& map : maps_) {
      if (map.snapshot) run_.run.maps.push_back(RecordOfMap(map, maps_));
    }
    run_.run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    run_.run.peak_memory_mb = PeakMemoryMegabytes();
    run_.truth = GroundTruthOf(*simulation_);
    run_.segments = SegmentsOf(*simulation_);
    run_.report = EvaluateRun(run_.run, run_.truth, run_.segments);
  }

  const EvaluatedRun& evaluated() const { return run_; }
  const std::vector<Session::MapState>& maps() const { return maps_; }

 private:
  std::shared_ptr<const Simulation> simulation_;
  const int first_frame_, end_frame_;
  EvaluatedRun run_;
  std::vector<Session::MapState> maps_;
};

GuideRequest CommonRequest(const DemoOptions& options, maps::Library* library, const fs::path& output) {
  GuideRequest request;
  request.library = library;
  request.headless = options.headless;
  // Without a window the timestamps do not matter, and lockstep gives the same result on every machine.
  request.pace = options.headless ? Pace::kLockstep : Pace::kRealtime;
  request.seed = options.seed;
  request.occlusion = options.occlusion;
  request.room_light = options.room_light;
  request.output = output;
  return request;
}

// Saves one image of the tour for each map: the frame after one second of tracking in it.
class TourImages {
 public:
  explicit TourImages(fs::path folder) : folder_(std::move(folder)) {}
  void Add(const ShownFrame& frame, const cv::Mat& image) {
    if (!engine::HasPose(frame.tracked.state)) return;
    constexpr int kFrames = 30;
    if (++tracked_frames_[frame.shown.map_name] != kFrames) return;
    WriteImage(folder_ / ("tour-" + FileName(frame.shown.map_name) + ".png"), image);
  }

 private:
  const fs::path folder_;
  std::map<std::string, int> tracked_frames_;  // By map name.
};

void DrawMaps(const std::vector<Session::MapState>& maps, const fs::path& folder) {
  ui::OffscreenContext context;
  ui::MapView view;
  cv::Mat image;
  for (const Session::MapState& map : maps) {
    if (map.discarded || !map.snapshot) continue;
    view.Draw(*map.snapshot, ui::OrbitAbove(*map.snapshot),
              {map.scene.get(), map.name, PredictRecall(*map.snapshot), true, std::nullopt});
    view.ReadBack(&image);
    WriteImage(folder / ("map-" + FileName(map.name) + ".png"), image);
  }
}

void PrintSummary(const DrawingCheck& check, std::size_t maps, const fs::path& folder) {
  const auto percent = [&](int frames) {
    return check.visit_frames() > 0 ? 100.0 * frames / check.visit_frames() : 0.0;
  };
  std::printf("%zu maps were built and content was placed in them.\n", maps);
  std::printf("The right bay was recognized in %.0f %% of %d images, a wrong one in %.0f %%.\n",
              percent(check.recognized_correctly()), check.visit_frames(),
              percent(check.recognized() - check.recognized_correctly()));
  if (!check.errors_px().empty()) {
    std::printf("Median placement error: %s pixels; 95 %% of %zu drawn objects are within %s pixels.\n",
                FormatNumber(Quantile(check.errors_px(), 0.5), 3).c_str(), check.errors_px().size(),
                FormatNumber(Quantile(check.errors_px(), 0.95), 3).c_str());
  }
  std::printf("Results: %s\n", folder.string().c_str());
}

}  // namespace

void RunDemo(const DemoOptions& options, Verbosity verbosity) {
  const fs::path folder = OutputFolder(options);
  const fs::path library_path = folder / "museum.docent";
  CheckLibrary(library_path, folder);
  SimulationOptions simulation_options;
  simulation_options.seed = options.seed;
  const std::shared_ptr<const Simulation> simulation = MakeSimulation(kScene, simulation_options);
  MuseumDirector director(*simulation, kModelFile);
  DemoRun author(simulation, 0, director.first_visit_frame(), "author");
  {
    const maps::SessionLock lock(library_path, maps::SessionLockKind::kSession);
    fs::remove(library_path);  // An earlier demonstration may have left one.
    WriteModel(folder / kModelFile);
    maps::Library library = OpenLibrary(library_path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    GuideRequest request = CommonRequest(options, &library, folder / "author");
    request.may_write = true;
    request.model_folder = folder;
    request.record_script = ScriptIn(folder);
    request.title = "Docent demonstration - the author";
    request.director = [&](const ShownFrame& frame) { return director.Direct(frame); };
    author.Run(std::move(request), verbosity);
  }

  DemoRun tour(simulation, director.first_visit_frame(), simulation->frame_count(), "tour");
  DrawingCheck check(*simulation, director.truths());
  {
    maps::Library library = OpenLibrary(library_path, maps::Access::kReadOnly);
    GuideRequest request = CommonRequest(options, &library, folder / "tour");
    request.title = "Docent demonstration - the tour";
    request.record = options.record ? *options.record : folder / "tour.mp4";
    TourImages images(folder);
    request.on_frame = [&](const ShownFrame& frame, const engine::MapperTimes&) { check.Add(frame); };
    request.on_image = [&](const ShownFrame& frame, const cv::Mat& image) { images.Add(frame, image); };
    tour.Run(std::move(request), verbosity);
  }
  DrawMaps(tour.maps(), folder);
  WriteJsonReport(folder / "report.json", {author.evaluated().report, tour.evaluated().report});
  WriteHtmlReport(folder / "report.html", {author.evaluated(), tour.evaluated()});
  if (verbosity != Verbosity::kQuiet) {
    PrintSummary(check, tour.maps().size(), folder);
  } else {
    std::printf("%s\n", folder.string().c_str());
  }
}

}  // namespace docent::app
