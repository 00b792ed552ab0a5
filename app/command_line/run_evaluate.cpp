// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "app/cameras/simulated_source.h"
#include "app/command_line/progress.h"
#include "app/command_line/runs.h"
#include "app/evaluation/frame_dump.h"
#include "app/evaluation/html_report.h"
#include "app/evaluation/json_report.h"
#include "app/evaluation/panorama_picture.h"
#include "app/evaluation/simulated_truth.h"
#include "app/files/checked_file.h"
#include "app/output/run_output.h"
#include "app/session/frame_loop.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// A sequence with what is known to be true of it.
struct Sequence {
  CalibratedCamera camera;
  std::vector<TimedPose> truth;
  std::vector<TimedLabel> segments;
};

Sequence OpenSequence(const EvaluateOptions& options, std::size_t index) {
  const std::string& word = options.sequences[index];
  std::optional<std::filesystem::path> calibration;
  if (index < options.calibrations.size()) calibration = options.calibrations[index];
  Sequence sequence;
  if (word.starts_with("sim:")) {
    SimulationOptions simulation_options;
    simulation_options.seed = options.seed;
    const std::shared_ptr<const Simulation> simulation = MakeSimulation(word.substr(4), simulation_options);
    sequence.truth = GroundTruthOf(*simulation);
    sequence.segments = SegmentsOf(*simulation);
    sequence.camera = Calibrate(OpenSimulation(simulation), calibration);
    return sequence;
  }
  CameraOptions camera_options;
  camera_options.seed = options.seed;
  sequence.camera = Calibrate(OpenCamera(word, camera_options), calibration);
  const SourceInfo& info = sequence.camera.source->info();
  if (info.live) throw Error("'" + word + "' is a live camera; evaluate takes recorded sequences.");
  if (info.ground_truth_path) sequence.truth = ReadGroundTruth(*info.ground_truth_path);
  if (info.segments_path) sequence.segments = ReadSegments(*info.segments_path);
  return sequence;
}

SessionOptions OptionsFor(const EvaluateOptions& options) {
  SessionOptions session;
  session.threaded = options.pace != Pace::kLockstep;
  session.tracker.hybrid = options.engine == EngineKind::kHybrid;
  session.tracker.turn_center.enabled = !options.turn_about_camera;
  if (options.turn_about_camera) session.tracker.max_turn_sigma = session.tracker.max_sigma;
  session.mapper.loops.enabled = !options.leave_loops_open;
  session.first_map = "map";
  session.seed = options.seed;
  return session;
}

// Stitches what a map knows by turning, into the output folder and for the report.
void StitchMap(const std::filesystem::path& folder, const Session::MapState& map,
               std::vector<ShownPanorama>* shown) {
  for (const PanoramaPicture& panorama : StitchPanoramas(*map.snapshot)) {
    const std::string number = std::to_string(map.key) + "-" + std::to_string(panorama.panorama);
    ShownPanorama picture;
    picture.caption = "panorama-" + number + ".png: " + std::to_string(panorama.keyframes) +
                      " keyframes of the map '" + map.name + "'";
    picture.png = EncodePng(panorama.picture);
    CheckedFile file(folder / ("panorama-" + number + ".png"));
    file.Write({reinterpret_cast<const char*>(picture.png.data()), picture.png.size()});
    file.Close();
    shown->push_back(std::move(picture));
  }
}

void DumpFrame(const std::filesystem::path& folder, std::size_t number, const engine::TrackedFrame& frame,
               const Session& session) {
  // The tracker has not seen a frame that was dropped.
  const bool dropped = frame.state == engine::TrackingState::kDropped;
  WriteFrameDump(folder, number, frame, dropped ? engine::FrameInspection() : session.Inspect(frame));
}

// So that a wrong number is told before the sequence is run.
void CheckDumpFrames(const EvaluateOptions& options, const SourceInfo& info) {
  if (!info.frame_count) return;
  for (const std::size_t number : options.dump_frames) {
    if (number < *info.frame_count) continue;
    throw Error("--dump-frame " + std::to_string(number) + ": '" + info.name + "' has " +
                std::to_string(*info.frame_count) + " frames, and the first one is 0.");
  }
}

// Tracks the whole sequence in a fresh session and leaves its files in the folder of that name.
RunRecord Track(const EvaluateOptions& options, CalibratedCamera* camera, const std::string& name,
                Verbosity verbosity, bool has_truth, std::vector<ShownPanorama>* panoramas) {
  RunRecord record;
  record.name = name;
  record.engine = ToString(options.engine);
  ResetPeakMemory();
  const auto start = std::chrono::steady_clock::now();
  RunOutput output(options.output / name);
  RunRecorder recorder;
  std::optional<Session> in_use(std::in_place, OptionsFor(options), std::vector{camera->model}, nullptr);
  Session& session = *in_use;
  Progress progress(name, camera->source->info().frame_count, verbosity);
  FrameLoopOptions loop;
  loop.pace = options.pace;
  const auto write_events = [&] {
    for (const Event& event : session.TakeEvents()) output.Add(event);
  };
  try {
    RunFrames(camera, &session, loop,
              [&](const engine::TrackedFrame& frame) {
                const std::size_t number = recorder.frames().size();
                if (std::count(options.dump_frames.begin(), options.dump_frames.end(), number) > 0)
                  DumpFrame(options.output / name, number, frame, session);
                recorder.Add(frame, MakeMappingTimes(session.MappingTimes()));
                output.Add(frame, session.ShownWith(frame).map_name);
                write_events();
                progress.Update(recorder.frames().size());
              },
              {});
    session.Finish();
  } catch (...) {
    write_events();
    output.Close();
    throw;
  }
  write_events();
  output.Close();
  record.frames = recorder.frames();
  record.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  record.peak_memory_mb = PeakMemoryMegabytes();
  record.mapping = MakeMappingTimes(session.MappingTimes());
  for (const LensWatch::Ring& ring : session.LensErrors(0))
    record.lens_rings.push_back({ring.samples, ring.mean_px, ring.sigma_px});
  // What follows needs the maps, and memory for one of them over again, but not all that tracked and mapped.
  std::vector<Session::MapState> maps = session.Maps();
  in_use.reset();
  for (const Session::MapState& map : maps) {
    if (!map.snapshot) continue;
    record.maps.push_back(MakeMapRecord(map.key, map.name, *map.snapshot));
    record.maps.back().discarded = map.discarded;
    if (map.discarded) continue;
    if (has_truth) record.maps.back().adjusted_centers = AdjustedCenters(*map.snapshot);
    StitchMap(options.output / name, map, panoramas);
  }
  return record;
}

// Names the sequence's folder below the output: no separators, and no two alike.
std::string FreeFolderName(std::string name, std::set<std::string>* taken) {
  for (char& c : name) {
    if (c == '/' || c == ':') c = '-';
  }
  if (name.empty() || name == "." || name == "..") name = "sequence";
  std::string free = name;
  for (int number = 2; !taken->insert(free).second; ++number) free = name + "-" + std::to_string(number);
  return free;
}

EvaluatedRun Evaluate(const EvaluateOptions& options, Sequence sequence, const std::string& name,
                      Verbosity verbosity) {
  EvaluatedRun run;
  run.run = Track(options, &sequence.camera, name, verbosity, !sequence.truth.empty(), &run.panoramas);
  run.truth = std::move(sequence.truth);
  run.segments = std::move(sequence.segments);
  run.report = EvaluateRun(run.run, run.truth, run.segments);
  if (verbosity != Verbosity::kQuiet) {
    std::printf("%s\n", FormatSummary(run.report).c_str());
    std::fflush(stdout);
  }
  return run;
}

void WriteReports(const std::filesystem::path& folder, const std::vector<EvaluatedRun>& runs) {
  std::vector<SequenceReport> reports, compared;
  for (const EvaluatedRun& run : runs) {
    reports.push_back(run.report);
    if (run.compared) compared.push_back(run.compared->report);
  }
  WriteJsonReport(folder / "report.json", reports, compared);
  WriteHtmlReport(folder / "report.html", runs);
}

}  // namespace

void RunEvaluate(const EvaluateOptions& options, Verbosity verbosity) {
  std::vector<EvaluatedRun> runs;
  std::set<std::string> taken;
  std::exception_ptr failure;
  for (std::size_t i = 0; i < options.sequences.size() && !failure; ++i) {
    try {
      Sequence sequence = OpenSequence(options, i);
      CheckDumpFrames(options, sequence.camera.source->info());
      MakeFolder(options.output);  // not before there is something to put into it
      const std::string name = FreeFolderName(sequence.camera.source->info().name, &taken);
      runs.push_back(Evaluate(options, std::move(sequence), name, verbosity));
      if (!options.compare) continue;
      EvaluateOptions other = options;
      other.engine = options.engine == EngineKind::kHybrid ? EngineKind::kSixDof : EngineKind::kHybrid;
      const std::string other_name = FreeFolderName(name + "-" + ToString(other.engine), &taken);
      runs.back().compared =
          std::make_shared<EvaluatedRun>(Evaluate(other, OpenSequence(options, i), other_name, verbosity));
    } catch (const Error&) {
      // What was evaluated before is reported all the same.
      failure = std::current_exception();
    }
  }
  if (!runs.empty()) WriteReports(options.output, runs);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace docent::app
