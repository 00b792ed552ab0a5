// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <optional>
#include <vector>

#include "engine/mapping/map_adjustment.h"
#include "engine/tracking/point_search.h"
#include "engine/vision/features.h"
#include "engine/vision/rotation_alignment.h"
#include "tests/bench/bench_sequence.h"

// The parts that a frame and a keyframe are made of, each alone.
namespace docent::bench {
namespace {

bool HasMap(benchmark::State* state) {
  if (Sequence().map) return true;
  state->SkipWithError("no map could be started on this sequence");
  return false;
}

void ExtractFeatures(benchmark::State& state) {
  const BenchSequence& sequence = Sequence();
  engine::ImageFeatures features;
  std::size_t next = 0;
  for (auto _ : state) {
    const auto hint = features.fast_threshold;
    engine::ExtractFeatures(sequence.frames[next].picture, {}, hint, &features);
    next = (next + 1) % sequence.frames.size();
  }
}
BENCHMARK(ExtractFeatures)->Unit(benchmark::kMicrosecond);

void AlignRotation(benchmark::State& state) {
  const BenchSequence& sequence = Sequence();
  std::vector<engine::SmallBlurryImage> thumbnails;
  for (const engine::Frame& frame : sequence.frames) {
    thumbnails.push_back(engine::MakeSmallBlurryImage(frame.picture));
    if (thumbnails.size() == 100) break;
  }
  std::size_t next = 1;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        engine::AlignRotation(thumbnails[next - 1], *sequence.camera, thumbnails[next], *sequence.camera));
    next = next + 1 < thumbnails.size() ? next + 1 : 1;
  }
}
BENCHMARK(AlignRotation)->Unit(benchmark::kMicrosecond);

// A point of the map, looked for in a frame that was tracked, about where it should be.
void PredictAndFindAPoint(benchmark::State& state) {
  if (!HasMap(&state)) return;
  const BenchSequence& sequence = Sequence();
  std::size_t index = sequence.tracked.size() / 2;
  while (index < sequence.tracked.size() && !HasPose(sequence.tracked[index].state)) ++index;
  if (index == sequence.tracked.size()) {
    state.SkipWithError("no frame was tracked in the second half of this sequence");
    return;
  }
  const auto features = engine::MakeFeatures(sequence.frames[index].picture);
  const engine::Rigid3& pose = sequence.tracked[index].camera_from_map;
  engine::PointSearcher searcher;
  std::size_t next = 0;
  double looked_for = 0, found = 0;
  for (auto _ : state) {
    std::optional<engine::PredictedPoint> predicted;
    while (!predicted) {
      const engine::MapPoint& point = sequence.map->points[next];
      next = (next + 1) % sequence.map->points.size();
      const engine::KeyFrame& source = *sequence.map->FindKeyFrame(point.source_keyframe);
      predicted = searcher.Predict(point, source, *sequence.camera, pose);
      if (!predicted) continue;
      ++looked_for;
      found += searcher.Find(point, source, *predicted, *features, 7, true).has_value();
    }
  }
  state.counters["found"] = looked_for > 0 ? found / looked_for : 0;
}
BENCHMARK(PredictAndFindAPoint)->Unit(benchmark::kMicrosecond);

void AdjustLocally(benchmark::State& state) {
  if (!HasMap(&state)) return;
  const engine::MapSnapshot& snapshot = *Sequence().map;
  const engine::KeyFrameId newest = snapshot.keyframes.back().id;
  for (auto _ : state) {
    state.PauseTiming();
    engine::Map map(snapshot);
    // About the error that a new keyframe comes with.
    engine::Rigid3& pose = map.FindKeyFrame(newest)->keyframe.camera_from_map;
    pose.translation.x() += 0.002 * map.FindKeyFrame(newest)->keyframe.mean_depth;
    state.ResumeTiming();
    benchmark::DoNotOptimize(engine::AdjustLocally({}, newest, nullptr, &map));
  }
  state.counters["keyframes"] = static_cast<double>(snapshot.keyframes.size());
  state.counters["points"] = static_cast<double>(snapshot.points.size());
}
BENCHMARK(AdjustLocally)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
