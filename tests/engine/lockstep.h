// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "engine/mapping/mapper.h"
#include "engine/tracking/tracker.h"

namespace docent::engine {

// A tracker and its mapper in turn on one thread, as a session in lockstep runs them: after every frame the
// mapper has done what it was given, and the tracker goes on in the map that came of it. Begins a new map.
class Lockstep {
 public:
  static constexpr std::uint64_t kMapKey = 1;

  Lockstep(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
      : tracker_(options, std::move(camera), seed), mapper_({}) {
    tracker_.StartNewMap();
  }

  // `places` as the tracker takes them.
  TrackedFrame Feed(const Frame& frame, const PlaceFinder* places = nullptr) {
    TrackedFrame tracked = tracker_.Track(frame, places);
    if (auto pair = tracker_.TakeInitialPair()) mapper_.Start(std::move(*pair));
    if (auto candidate = tracker_.TakeKeyFrameCandidate()) {
      mapper_.Report(tracker_.TakeReports());
      mapper_.Offer(std::move(*candidate));
    }
    for (int step = 0; step < 20 && !mapper_.IsIdle(); ++step) mapper_.Step();
    mapper_.Step();
    for (MapperEvent& event : mapper_.TakeEvents()) {
      if (event.kind == MapperEvent::Kind::kStartFailed) tracker_.StartFailed();
      events_.push_back(std::move(event));
    }
    if (mapper_.Snapshot() != map_) {
      map_ = mapper_.Snapshot();
      tracker_.SetMap(map_, kMapKey);
    }
    return tracked;
  }

  // Null until there is one.
  const std::shared_ptr<const MapSnapshot>& map() const { return map_; }
  // All that the mapper has told, in its order.
  const std::vector<MapperEvent>& events() const { return events_; }

 private:
  Tracker tracker_;
  Mapper mapper_;
  std::shared_ptr<const MapSnapshot> map_;
  std::vector<MapperEvent> events_;
};

}  // namespace docent::engine
