// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "engine/tracking/tracker.h"
#include "tests/bench/bench_sequence.h"

// The cost of a frame in maps of 1 000 to 50 000 points. The sequence's own map is reduced if it has more
// points; if it has fewer, shifted copies of it are added, like the rooms of a larger house. The camera moves
// through the first copy. Relocalization is told which copy that is, since exact copies cannot be
// distinguished, and has a benchmark of its own. Counters: the map's points and keyframes, the points
// searched per tracked frame, and the frames' median and 95th percentile of CPU time in milliseconds.
namespace docent::bench {
namespace {

using engine::MapSnapshot;

// Adds a copy of the map, `apart` to the right; its ids continue those of the map.
void AddCopy(const MapSnapshot& source, std::size_t every, double apart, MapSnapshot* map) {
  const engine::KeyFrameId first_keyframe = map->next_keyframe;
  const engine::MapPointId first_point = map->next_point;
  const engine::PanoramaId first_panorama = map->next_panorama;
  const Eigen::Vector3d offset(apart, 0, 0);
  const auto is_kept = [&](const engine::MapPoint& point) {
    return static_cast<std::size_t>(&point - source.points.data()) % every == 0;
  };
  for (const engine::KeyFrame& keyframe : source.keyframes) {
    engine::KeyFrame copy = keyframe;
    copy.id += first_keyframe;
    if (copy.panorama != engine::kNoId) copy.panorama += first_panorama;
    copy.camera_from_map.translation -= copy.camera_from_map.rotation * offset;
    map->keyframes.push_back(copy);
  }
  for (const engine::MapPoint& point : source.points) {
    if (!is_kept(point)) continue;
    engine::MapPoint copy = point;
    copy.id += first_point;
    copy.source_keyframe += first_keyframe;
    if (copy.infinite()) {
      copy.panorama += first_panorama;
    } else {
      copy.point_in_map.head<3>() += offset;
    }
    map->points.push_back(copy);
  }
  for (const engine::Observation& observation : source.observations) {
    const engine::MapPoint* point = source.FindPoint(observation.point);
    if (!is_kept(*point)) continue;
    engine::Observation copy = observation;
    copy.keyframe += first_keyframe;
    copy.point += first_point;
    map->observations.push_back(copy);
  }
  for (const engine::PanoramaMap& panorama : source.panoramas)
    map->panoramas.push_back({panorama.id + first_panorama, panorama.reference + first_keyframe});
  map->next_keyframe += source.next_keyframe;
  map->next_point += source.next_point;
  map->next_panorama += source.next_panorama;
}

std::shared_ptr<const MapSnapshot> MapOf(std::size_t points, const MapSnapshot& source) {
  auto map = std::make_shared<MapSnapshot>();
  const std::size_t every = std::max<std::size_t>(1, source.points.size() / points);
  double reach = 0;
  for (const engine::KeyFrame& keyframe : source.keyframes) {
    reach = std::max(
        reach, keyframe.camera_from_map.OriginInSource().norm() + keyframe.mean_depth + keyframe.depth_sigma);
  }
  for (int copy = 0; copy == 0 || map->points.size() + source.points.size() / every / 2 < points; ++copy)
    AddCopy(source, every, 2 * reach * copy, map.get());
  return map;
}

void TrackFrameInMapOf(benchmark::State& state) {
  const BenchSequence& sequence = Sequence();
  if (!sequence.map) {
    state.SkipWithError("no map could be started on this sequence");
    return;
  }
  const auto map = MapOf(static_cast<std::size_t>(state.range(0)), *sequence.map);
  if (const std::string fault = engine::Validate(*map); !fault.empty()) {
    state.SkipWithError(fault.c_str());
    return;
  }
  const MapPlaces places(map, sequence.map->keyframes.size());
  std::vector<double> milliseconds;
  int tracked = 0;
  double searched = 0;
  for (auto _ : state) {
    engine::Tracker tracker(TourOptions(), sequence.camera, 1);
    tracker.SetMap(map, MapPlaces::kKey);
    engine::TrackedFrame out;
    double total = 0;
    for (const engine::Frame& frame : sequence.frames) {
      const double start = ThreadMilliseconds();
      tracker.Track(frame, &places, &out);
      milliseconds.push_back(ThreadMilliseconds() - start);
      total += milliseconds.back();
      if (!HasPose(out.state)) continue;
      ++tracked;
      if (out.quality > 0) searched += (out.finite_points + out.infinite_points) / out.quality;
    }
    state.SetIterationTime(1e-3 * total);
  }
  state.SetLabel(sequence.name);
  state.counters["points"] = static_cast<double>(map->points.size());
  state.counters["keyframes"] = static_cast<double>(map->keyframes.size());
  state.counters["tracked"] = static_cast<double>(tracked) / static_cast<double>(milliseconds.size());
  state.counters["searched"] = searched / std::max(1, tracked);
  state.counters["median_ms"] = Quantile(&milliseconds, 0.5);
  state.counters["p95_ms"] = Quantile(&milliseconds, 0.95);
}

BENCHMARK(TrackFrameInMapOf)
    ->Arg(1000)
    ->Arg(2000)
    ->Arg(5000)
    ->Arg(10000)
    ->Arg(20000)
    ->Arg(50000)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
