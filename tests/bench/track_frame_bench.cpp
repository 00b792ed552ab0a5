// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <opencv2/features2d.hpp>
#include <vector>

#include "engine/tracking/tracker.h"
#include "tests/bench/bench_sequence.h"

// The cost of a frame: tracking it in a finished map, compared with the extraction of a thousand ORB features
// from the same image, the first step of feature-based trackers. All on one thread, in milliseconds of CPU
// time. Counters:
//   *_median_ms, *_p95_ms    over the frames, lost ones with their relocalization included
//   tracked                  ratio of the frames that had a pose
//   median_ratio, p95_ratio  tracking divided by ORB
namespace docent::bench {
namespace {

// A tracker in the finished map, which stays unchanged.
engine::Tracker TourOf(const BenchSequence& sequence) {
  engine::Tracker tracker(TourOptions(), sequence.camera, 1);
  tracker.SetMap(sequence.map, MapPlaces::kKey);
  return tracker;
}

class OrbExtraction {
 public:
  OrbExtraction() : orb_(cv::ORB::create(1000, 1.2f, 8)) {}
  double Milliseconds(const cv::Mat& gray) {
    const double start = ThreadMilliseconds();
    orb_->detectAndCompute(gray, cv::noArray(), keypoints_, descriptors_);
    return ThreadMilliseconds() - start;
  }

 private:
  cv::Ptr<cv::ORB> orb_;
  std::vector<cv::KeyPoint> keypoints_;
  cv::Mat descriptors_;
};

struct Timings {
  std::vector<double> track_ms, orb_ms;
  int tracked = 0;
  double total_ms = 0;
};

Timings GoThrough(const BenchSequence& sequence, bool track, bool extract) {
  Timings timings;
  engine::Tracker tracker = TourOf(sequence);
  const MapPlaces places(sequence.map);
  OrbExtraction orb;
  for (const engine::Frame& frame : sequence.frames) {
    if (track) {
      const double start = ThreadMilliseconds();
      const engine::TrackedFrame tracked = tracker.Track(frame, &places);
      timings.track_ms.push_back(ThreadMilliseconds() - start);
      timings.tracked += HasPose(tracked.state);
      timings.total_ms += timings.track_ms.back();
    }
    if (extract) {
      timings.orb_ms.push_back(orb.Milliseconds(frame.image));
      timings.total_ms += timings.orb_ms.back();
    }
  }
  return timings;
}

void Report(const BenchSequence& sequence, Timings timings, benchmark::State* state) {
  state->SetLabel(sequence.name);
  auto& counters = state->counters;
  counters["frames"] = static_cast<double>(sequence.frames.size());
  if (!timings.track_ms.empty()) {
    counters["tracked"] = static_cast<double>(timings.tracked) / static_cast<double>(sequence.frames.size());
    counters["track_median_ms"] = Quantile(&timings.track_ms, 0.5);
    counters["track_p95_ms"] = Quantile(&timings.track_ms, 0.95);
  }
  if (!timings.orb_ms.empty()) {
    counters["orb_median_ms"] = Quantile(&timings.orb_ms, 0.5);
    counters["orb_p95_ms"] = Quantile(&timings.orb_ms, 0.95);
  }
  if (!timings.track_ms.empty() && !timings.orb_ms.empty()) {
    counters["median_ratio"] = Quantile(&timings.track_ms, 0.5) / Quantile(&timings.orb_ms, 0.5);
    counters["p95_ratio"] = Quantile(&timings.track_ms, 0.95) / Quantile(&timings.orb_ms, 0.95);
  }
}

void Measure(bool track, bool extract, benchmark::State* state) {
  const BenchSequence& sequence = Sequence();
  if (!sequence.map) {
    state->SkipWithError("no map could be started on this sequence");
    return;
  }
  Timings timings;
  for (auto _ : *state) {
    timings = GoThrough(sequence, track, extract);
    state->SetIterationTime(1e-3 * timings.total_ms);
  }
  Report(sequence, std::move(timings), state);
}

void TrackFrame(benchmark::State& state) {
  Measure(true, false, &state);
}
void OrbExtraction1000(benchmark::State& state) {
  Measure(false, true, &state);
}
// One frame of each in turn, so that a slow machine affects both alike.
void TrackFrameAgainstOrb(benchmark::State& state) {
  Measure(true, true, &state);
}

BENCHMARK(TrackFrame)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(OrbExtraction1000)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(TrackFrameAgainstOrb)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
