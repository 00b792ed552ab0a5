// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_sequence.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>

#include "app/cameras/frame_source.h"
#include "app/session/calibrated_camera.h"
#include "app/session/session.h"

namespace docent::bench {

namespace {

constexpr std::size_t kSimulatedFrames = 300;

void ReadImages(BenchSequence* sequence) {
  const char* named = std::getenv("DOCENT_BENCH_SEQUENCE");
  app::QuietDecoders();
  app::CalibratedCamera camera = app::Calibrate(app::OpenCamera(named ? named : "sim:room"), std::nullopt);
  sequence->name = camera.source->info().name;
  sequence->camera = camera.model;
  engine::Frame frame;
  while (camera.source->Next(&frame)) {
    camera.CheckImage(frame.image);
    if (frame.image.channels() == 3) {
      cv::Mat gray;
      cv::cvtColor(frame.image, gray, cv::COLOR_BGR2GRAY);
      frame.image = gray;
    }
    sequence->frames.push_back(frame);
    if (!named && sequence->frames.size() == kSimulatedFrames) break;
  }
}

void MakeMap(BenchSequence* sequence) {
  app::SessionOptions options;
  options.threaded = false;
  options.tracker.hybrid = true;
  options.first_map = "map";
  app::Session session(options, {sequence->camera}, nullptr);
  for (const engine::Frame& frame : sequence->frames) sequence->tracked.push_back(session.Process(frame));
  session.Finish();
  for (const app::Session::MapState& map : session.Maps()) {
    if (!map.discarded && map.snapshot) sequence->map = map.snapshot;
  }
}

BenchSequence MakeSequence() {
  cv::setNumThreads(1);
  BenchSequence sequence;
  ReadImages(&sequence);
  MakeMap(&sequence);
  return sequence;
}

}  // namespace

const BenchSequence& Sequence() {
  static const BenchSequence sequence = MakeSequence();
  return sequence;
}

std::vector<engine::PlaceCandidate> MapPlaces::FindPlaces(const engine::PlaceQuery& query, int count,
                                                          int per_map, std::uint64_t only_map) const {
  std::vector<engine::PlaceCandidate> found;
  if (only_map != 0 && only_map != kKey) return found;
  for (const engine::KeyFrame& keyframe : std::span(map_->keyframes).first(keyframes_)) {
    const double difference = engine::Difference(keyframe.features->small_blurry, *query.image);
    if (std::isfinite(difference)) found.push_back({kKey, map_, keyframe.id, difference});
  }
  const auto wanted = static_cast<std::size_t>(std::max(0, std::min(count, per_map)));
  const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(wanted, found.size()));
  std::partial_sort(found.begin(), end, found.end(),
                    [](const auto& a, const auto& b) { return a.difference < b.difference; });
  found.erase(end, found.end());
  return found;
}

double ThreadMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double Quantile(std::vector<double>* values, double part) {
  if (values->empty()) return 0;
  std::sort(values->begin(), values->end());
  const auto index = static_cast<std::size_t>(part * static_cast<double>(values->size() - 1) + 0.5);
  return (*values)[index];
}

}  // namespace docent::bench
