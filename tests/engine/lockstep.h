// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "engine/mapping/mapper.h"
#include "engine/tracking/tracker.h"

namespace docent::engine {

// Runs a tracker and its mapper alternately on one thread, as a session in lockstep does: after every frame
// the mapper finishes its queue, and the tracker continues in the resulting map. The constructor begins a new
// map.
class Lockstep {
 public:
  static constexpr std::uint64_t kMapKey = 1;

  Lockstep(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
      : tracker_(options, std::move(camera), seed), mapper_({}) {
    tracker_.StartNewMap();
  }

  // `places` is passed on to Tracker::Track.
  TrackedFrame Feed(const Frame& frame, const PlaceFinder* places = nullptr) {
    TrackedFrame tracked = tracker_.Track(frame, places);
    if (auto pair = tracker_.TakeInitialPair(); pair && !mapper_.Start(std::move(*pair)))
      tracker_.StartFailed();
    if (auto candidate = tracker_.TakeKeyFrameCandidate()) {
      mapper_.Report(tracker_.TakeReports());
      if (mapper_.Offer(std::move(*candidate))) tracker_.KeyFrameAccepted();
    }
    for (int step = 0; step < 20 && !mapper_.IsIdle(); ++step) mapper_.Step();
    mapper_.Step();
    for (MapperEvent& event : mapper_.TakeEvents()) {
      if (std::holds_alternative<MapperEvent::StartFailed>(event.what)) tracker_.StartFailed();
      events_.push_back(std::move(event));
    }
    map_ = mapper_.Snapshot();
    if (map_) tracker_.SetMap(map_, kMapKey);
    return tracked;
  }

  // Null until the first map exists.
  const std::shared_ptr<const MapSnapshot>& map() const { return map_; }
  // All events of the mapper so far, in order.
  const std::vector<MapperEvent>& events() const { return events_; }

 private:
  Tracker tracker_;
  Mapper mapper_;
  std::shared_ptr<const MapSnapshot> map_;
  std::vector<MapperEvent> events_;
};

}  // namespace docent::engine
