// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "engine/mapping/calibration/lens_estimation.h"
#include "engine/mapping/mapper_event.h"

namespace docent::engine {

// CPU seconds by task.
struct MapperTimes {
  double bundle_adjustment = 0, panorama_localization = 0, infinite_triangulation = 0, loop_closing = 0,
         other = 0;
  int loops_closed = 0;
  double max_queue_latency = 0;  // seconds; longest time that one step delayed an offered keyframe
};

// What the mapper has to show: its newest snapshot, events, lenses and times. The thread that runs the mapper
// writes, any thread reads.
class MapperOutput {
 public:
  explicit MapperOutput(std::vector<EstimatedLens> lenses) : lenses_(std::move(lenses)) {}

  // The last published state; null while there is no map.
  std::shared_ptr<const MapSnapshot> Snapshot() const;
  std::vector<MapperEvent> TakeEvents();
  MapperTimes Times() const;
  // The lenses of the newest snapshot.
  std::vector<EstimatedLens> Lenses() const;

  // Null: there is no map.
  void Publish(std::shared_ptr<const MapSnapshot> snapshot);
  template <typename What>
  void AddEvent(Timestamp time, What what) {
    const std::lock_guard lock(mutex_);
    events_.push_back({time, std::move(what)});
  }
  // To be called before the snapshot that uses them is published.
  void SetLenses(std::vector<EstimatedLens> lenses);
  void CountLoop();
  // Adds seconds to an account (null: to none), and the time by which they delayed a keyframe.
  void AddTime(double MapperTimes::*account, double seconds, double queue_latency);

 private:
  mutable std::mutex mutex_;  // guards all members; held only while pointers and small lists are copied
  std::shared_ptr<const MapSnapshot> snapshot_;
  std::vector<MapperEvent> events_;
  std::vector<EstimatedLens> lenses_;
  MapperTimes times_;
};

}  // namespace docent::engine
