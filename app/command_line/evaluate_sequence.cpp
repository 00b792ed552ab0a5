// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/evaluate_sequence.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stop_token>
#include <utility>

#include "app/cameras/clipped_source.h"
#include "app/cameras/simulated_source.h"
#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "app/evaluation/frame_dump.h"
#include "app/evaluation/panorama_image.h"
#include "app/evaluation/simulated_truth.h"
#include "app/evaluation/true_depth.h"
#include "app/files/checked_file.h"
#include "app/output/run_output.h"
#include "app/session/frame_loop.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

SessionOptions OptionsFor(const EvaluateOptions& options, std::uint64_t seed) {
  SessionOptions session;
  session.threaded = options.pace != Pace::kLockstep;
  session.tracker.hybrid = options.engine == EngineKind::kHybrid;
  session.tracker.rotation_center.enabled = !options.turn_about_camera;
  if (options.turn_about_camera) session.tracker.max_rotation_sigma = session.tracker.max_sigma;
  session.mapper.loops.enabled = !options.leave_loops_open;
  session.new_map_when_lost = options.when_lost == WhenLost::kNew;
  session.first_map = "map";
  session.seed = seed;
  return session;
}

// Stitches the panorama maps of a map, writes them into the folder and adds them to the report.
void StitchMap(const std::filesystem::path& folder, const Session::MapState& map,
               std::vector<ShownPanorama>* shown) {
  for (const PanoramaImage& panorama : StitchPanoramas(*map.snapshot)) {
    const std::string number = std::to_string(map.key) + "-" + std::to_string(panorama.panorama);
    ShownPanorama image;
    image.caption = "panorama-" + number + ".png: " + std::to_string(panorama.keyframes) +
                    " keyframes of the map '" + map.name + "'";
    image.png = EncodePng(panorama.image);
    CheckedFile file(folder / ("panorama-" + number + ".png"));
    file.Write({reinterpret_cast<const char*>(image.png.data()), image.png.size()});
    file.Close();
    shown->push_back(std::move(image));
  }
}

void DumpFrame(const std::filesystem::path& folder, std::size_t number, const engine::TrackedFrame& frame,
               const Session& session) {
  // Dropped frames were not tracked, so there is nothing to inspect.
  const bool dropped = frame.state == engine::TrackingState::kDropped;
  WriteFrameDump(folder, number, frame, dropped ? engine::FrameInspection() : session.Inspect(frame),
                 dropped ? std::string() : session.ShownWith(frame).hint);
}

// Adds the session's maps to the record and, unless this is one of many runs, their panoramas to the report.
void AddMaps(const std::vector<Session::MapState>& maps, const std::filesystem::path& folder, bool has_truth,
             bool one_of_many, RunRecord* record, std::vector<ShownPanorama>* panoramas) {
  for (const Session::MapState& map : maps) {
    if (!map.snapshot) continue;
    record->maps.push_back(RecordOfMap(map, maps));
    if (map.discarded || map.joined_into != 0 || one_of_many) continue;
    if (has_truth) record->maps.back().adjusted_centers = AdjustedCenters(*map.snapshot);
    StitchMap(folder, map, panoramas);
  }
}

// Throws Error when the sequence is too short for the requested windows.
void CheckStarts(const EvaluateOptions& options, const EvaluatedSequence& sequence) {
  if (options.starts == 1) return;
  const std::string prefix = "--starts " + std::to_string(options.starts) + ": '" + sequence.name + "' ";
  if (!sequence.frame_count)
    throw Error(prefix + "does not say how many frames it has, so it cannot be divided into windows.");
  if (*sequence.frame_count < options.starts) {
    throw Error(prefix + "has only " + std::to_string(*sequence.frame_count) +
                " frames, and each window needs a different first frame.");
  }
}

}  // namespace

MapRecord RecordOfMap(const Session::MapState& map, const std::vector<Session::MapState>& maps) {
  MapRecord record = MakeMapRecord(map.key, map.name, *map.snapshot);
  record.discarded = map.discarded;
  for (const Session::MapState& other : maps) {
    if (other.key == map.joined_into) record.joined_into = other.name;
  }
  return record;
}

EvaluatedSequence DescribeSequence(const EvaluateOptions& options, std::size_t index) {
  EvaluatedSequence sequence;
  sequence.word = options.sequences[index];
  if (index < options.calibrations.size()) sequence.calibration = options.calibrations[index];
  if (sequence.word.starts_with("sim:")) {
    SimulationOptions simulation_options;
    simulation_options.seed = options.seed;
    sequence.simulation = MakeSimulation(sequence.word.substr(4), simulation_options);
    sequence.truth = GroundTruthOf(*sequence.simulation);
    sequence.segments = SegmentsOf(*sequence.simulation);
  }
  // The sequence is opened once here, so that errors are reported before anything is run or written.
  const CalibratedCamera camera = OpenWindow(sequence, 0, {});
  const SourceInfo& info = camera.source->info();
  if (info.live) throw Error("'" + sequence.word + "' is a live camera; evaluate needs recorded sequences.");
  sequence.name = info.name;
  sequence.frame_count = info.frame_count;
  sequence.frames_per_second = info.nominal_fps;
  if (info.ground_truth_path) sequence.truth = ReadGroundTruth(*info.ground_truth_path);
  if (info.segments_path) sequence.segments = ReadSegments(*info.segments_path);
  CheckStarts(options, sequence);
  return sequence;
}

CalibratedCamera OpenWindow(const EvaluatedSequence& sequence, std::uint64_t first_frame, Timestamp window) {
  std::unique_ptr<FrameSource> source =
      sequence.simulation ? OpenSimulation(sequence.simulation) : OpenCamera(sequence.word);
  if (!source->info().live) source = WindowOf(std::move(source), first_frame, window);
  return Calibrate(std::move(source), sequence.calibration);
}

std::optional<std::vector<InitializationResult>> ClassifyInitializationsOf(const EvaluateOptions& options,
                                                                           const EvaluatedSequence& sequence,
                                                                           const RunKey& key,
                                                                           const RunRecord& run) {
  if (sequence.truth.empty()) return std::nullopt;
  FalseInitializationOptions start_options;
  start_options.truth_noise_m = sequence.simulation ? 0 : options.truth_noise_m;
  const auto true_depths = [&](const InitializationRecord& start) {
    std::vector<Eigen::Vector2f> pixels;
    for (const InitializationRecord::Point& point : start.points) pixels.push_back(point.pixel);
    const std::size_t frame = key.first_frame + start.frame;
    if (sequence.simulation)
      return SimulatedTrueDepths(*sequence.simulation, static_cast<int>(frame), pixels);
    TrueDepthOptions depth_options;
    depth_options.truth_noise_m = start_options.truth_noise_m;
    CalibratedCamera camera = OpenWindow(sequence, frame, {});
    // An unknown lens is only guessed where a run begins.
    if (run.lens_model) camera.model = run.lens_model;
    return MeasureTrueDepths(&camera, sequence.truth, pixels, depth_options);
  };
  return ClassifyInitializations(run, sequence.truth, true_depths, start_options);
}

std::vector<std::uint64_t> FirstFrames(std::size_t starts, std::uint64_t frames,
                                       std::uint64_t window_frames) {
  std::vector<std::uint64_t> first_frames;
  const bool fit = window_frames > 0 && window_frames + starts <= frames + 1;
  for (std::size_t start = 0; start < starts; ++start) {
    first_frames.push_back(fit && starts > 1 ? start * (frames - window_frames) / (starts - 1)
                                             : start * frames / starts);
  }
  return first_frames;
}

std::vector<RunKey> RunsOf(const EvaluateOptions& options, const EvaluatedSequence& sequence) {
  std::vector<RunKey> keys;
  const auto window_frames =
      static_cast<std::uint64_t>(std::ceil(ToSeconds(options.window) * sequence.frames_per_second));
  const std::vector<std::uint64_t> first_frames =
      FirstFrames(options.starts, sequence.frame_count.value_or(0), window_frames);
  for (std::size_t start = 0; start < options.starts; ++start) {
    const std::uint64_t first = first_frames[start];
    for (std::size_t seed = 0; seed < options.seeds; ++seed)
      keys.push_back({options.seed + seed, start, static_cast<std::size_t>(first)});
  }
  return keys;
}

void CheckRunFolder(const EvaluateOptions& options, const std::filesystem::path& folder) {
  for (const std::string& recording : options.sequences) {
    if (!LiesWithin(folder, recording)) continue;
    throw Error("The files of the run would be written into the recording '" + recording + "', to '" +
                folder.string() + "'; give another folder with --output.");
  }
}

RunRecord Track(const EvaluateOptions& options, const EvaluatedSequence& sequence,
                const TrackRequest& request, Verbosity verbosity, std::vector<ShownPanorama>* panoramas) {
  CalibratedCamera camera = OpenWindow(sequence, request.key.first_frame, options.window);
  RunRecord record;
  record.name = request.name;
  record.engine = ToString(options.engine);
  ResetPeakMemory();
  const auto start = std::chrono::steady_clock::now();
  RunOutput output(request.folder);
  RunRecorder recorder;
  SessionOptions session_options = OptionsFor(options, request.key.seed);
  session_options.mapper.lens.lenses = EstimatedLensesOf({&camera, 1});
  std::optional<Session> owned_session(std::in_place, session_options, std::vector{camera.model}, nullptr);
  Session& session = *owned_session;
  Progress progress(request.name, camera.source->info().frame_count,
                    request.one_of_many ? Verbosity::kQuiet : verbosity);
  FrameLoopOptions loop;
  loop.pace = options.pace;
  const auto write_events = [&] {
    for (const Event& event : session.TakeEvents()) output.Add(event);
  };
  try {
    std::stop_source stopping;
    RunFrames(
        &camera, &session, loop,
        [&](const engine::TrackedFrame& frame) {
          if (Interruption::requested()) stopping.request_stop();
          const std::size_t number = recorder.frames().size();
          if (std::count(options.dump_frames.begin(), options.dump_frames.end(), number) > 0)
            DumpFrame(request.folder, number, frame, session);
          recorder.Add(frame, MakeMappingTimes(session.MappingTimes()));
          output.Add(frame, session.ShownWith(frame).map_name);
          write_events();
          progress.Update(recorder.frames().size());
        },
        stopping.get_token());
    if (stopping.stop_requested()) throw Error("Interrupted; only the runs that were finished are reported.");
    session.Finish();
  } catch (...) {
    write_events();
    output.Close();
    throw;
  }
  write_events();
  output.Close();
  record.frames = recorder.frames();
  record.initializations = recorder.initializations();
  record.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  record.peak_memory_mb = PeakMemoryMegabytes();
  record.mapping = MakeMappingTimes(session.MappingTimes());
  if (const auto lens = session.EstimatedLensOf(0)) {
    record.lens = MakeLensRecord(*lens);
    record.lens_model = lens->model;
  }
  for (const engine::CalibrationMonitor::Ring& ring : session.LensErrors(0))
    record.lens_rings.push_back({ring.samples, ring.mean_px, ring.sigma_px});
  // The session is destroyed first, because the adjustments below need memory for another copy of a map.
  const std::vector<Session::MapState> maps = session.Maps();
  owned_session.reset();
  AddMaps(maps, request.folder, !sequence.truth.empty(), request.one_of_many, &record, panoramas);
  return record;
}

}  // namespace docent::app
