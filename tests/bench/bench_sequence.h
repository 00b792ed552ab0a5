// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/map/map_snapshot.h"
#include "engine/recognition/place.h"
#include "tests/engine/lockstep.h"

// What every benchmark measures on: grey images of one sequence in memory, and the map that tracker and
// mapper, run in turn, made of them. The sequence is the folder or file that the environment variable
// DOCENT_BENCH_SEQUENCE names (anything that --camera takes; its calibration beside it), else ten seconds of
// the simulator's room. Made once a process, by the first benchmark that asks; all on the calling thread.
namespace docent::bench {

struct BenchSequence {
  std::string name;
  std::shared_ptr<const engine::CameraModel> camera;
  std::vector<engine::Frame> frames;               // CV_8UC1
  std::shared_ptr<const engine::MapSnapshot> map;  // null when no map could be started
  std::vector<engine::TrackedFrame> tracked;       // one a frame: the pass that made the map
};

// Throws docent::Error when the sequence cannot be read.
const BenchSequence& Sequence();

// The first `keyframes` keyframes of one map by their thumbnails, so that a second pass may enter it from
// anywhere.
class MapPlaces : public engine::PlaceFinder {
 public:
  static constexpr std::uint64_t kKey = engine::Lockstep::kMapKey;
  explicit MapPlaces(std::shared_ptr<const engine::MapSnapshot> map,
                     std::size_t keyframes = std::numeric_limits<std::size_t>::max())
      : map_(std::move(map)), keyframes_(std::min(keyframes, map_->keyframes.size())) {}
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override;

 private:
  std::shared_ptr<const engine::MapSnapshot> map_;
  std::size_t keyframes_;
};

// Milliseconds that this thread has computed: on a machine that others use as well, the time on the wall
// measures them too.
double ThreadMilliseconds();

// The value below which this part of the values lies; the values are sorted by it.
double Quantile(std::vector<double>* values, double part);

}  // namespace docent::bench
