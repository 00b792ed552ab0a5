// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/map/map_snapshot.h"
#include "engine/recognition/place.h"
#include "engine/tracking/tracker.h"

// The data of all benchmarks: grey images of one sequence in memory, and the map that a session in lockstep
// with the program's defaults, panorama maps included, made of them. The environment variable
// DOCENT_BENCH_SEQUENCE names the sequence (anything that
// --camera accepts, with its calibration beside it); the default is ten seconds of the simulator's room.
// Created once per process, by the first benchmark that needs it, on the calling thread.
namespace docent::bench {

struct BenchSequence {
  std::string name;
  std::shared_ptr<const engine::CameraModel> camera;
  std::vector<engine::Frame> frames;               // CV_8UC1
  std::shared_ptr<const engine::MapSnapshot> map;  // null if no map could be started
  std::vector<engine::TrackedFrame> tracked;       // one per frame, from the pass that made the map
};

// The tracker's options of a tour with the program's defaults: panorama maps, and no new maps.
inline engine::TrackerOptions TourOptions() {
  engine::TrackerOptions options;
  options.hybrid = true;
  options.build_maps = false;
  return options;
}

// Throws docent::Error if the sequence cannot be read.
const BenchSequence& Sequence();

// A place index of the first `keyframes` keyframes of one map by their thumbnails, so that a second pass can
// be relocalized anywhere in it.
class MapPlaces : public engine::PlaceFinder {
 public:
  static constexpr std::uint64_t kKey = 1;
  explicit MapPlaces(std::shared_ptr<const engine::MapSnapshot> map,
                     std::size_t keyframes = std::numeric_limits<std::size_t>::max())
      : map_(std::move(map)), keyframes_(std::min(keyframes, map_->keyframes.size())) {}
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override;

 private:
  std::shared_ptr<const engine::MapSnapshot> map_;
  std::size_t keyframes_;
};

// CPU time of this thread in milliseconds. Wall time would include other processes of the machine.
double ThreadMilliseconds();

// The value below which this ratio of the values lies; sorts the values.
double Quantile(std::vector<double>* values, double part);

}  // namespace docent::bench
