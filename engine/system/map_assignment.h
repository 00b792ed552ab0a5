// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/time.h"

namespace docent::engine {

// The map that one camera is assigned to, and what its tracker still has to do about it. The state machine of
// a camera as the system sees it: no map, starting one, in one, or lost in it. Its owner guards it; the order
// is taken on the camera's thread with the next frame. Maps are named by their keys; 0 is none.
class MapAssignment {
 public:
  enum class Order : std::uint8_t {
    kNone,
    kStart,           // start a new map
    kStartAfterLoss,  // the same, while the known maps are searched too
    kStartAgain,      // the mapper could not make the map
    kGiveDepth,       // search initial views for the map without depth that it is tracked in
    kLeave,           // leave the map, and search all maps
    kEnter,           // search the map
  };

  // The camera starts this map. after_loss: because it was lost in another one.
  void Start(std::uint64_t map, bool after_loss);
  // It is tracked in a map without finite points, which no camera is starting.
  void GiveDepth() { order_ = Order::kGiveDepth; }
  // Another camera starts this map.
  void WaitFor(std::uint64_t map);
  // It searches this map.
  void Enter(std::uint64_t map);
  // It searches all maps.
  void Leave();
  // Its tracker entered this map by itself.
  void Follow(std::uint64_t map) {
    map_ = map;
    starting_ = false;
  }
  // Its pose was refused: it searches the map unless something else was ordered.
  void SearchAgain();
  // The mapper could not make the map of the initial views; nothing for a camera that does not start it.
  // has_snapshot: its panorama map stays.
  void FailStart(bool has_snapshot, bool after_loss);

  // The results of its frames: the camera, or another one in its map, is tracked, or all are lost.
  void SetTracked() { lost_since_.reset(); }
  void SetLost(Timestamp time);

  // To be called before each frame. has_finite_points: of the newest snapshot of the map.
  Order TakeOrder(bool has_finite_points);

  std::uint64_t map() const { return map_; }
  bool has_order() const { return order_ != Order::kNone; }
  // It searches the initial views of the map, from the start until the map has finite points.
  bool is_starting() const { return starting_; }
  // Of the maps that were started, it started the last one.
  bool started_map() const { return started_map_; }
  // Since when it is lost in the map together with all other cameras.
  std::optional<Timestamp> lost_since() const { return lost_since_; }
  bool IsLostFor(Timestamp duration, Timestamp now) const {
    return lost_since_ && now - *lost_since_ > duration;
  }

 private:
  std::uint64_t map_ = 0;
  Order order_ = Order::kNone;
  bool starting_ = false;
  bool started_map_ = false;
  std::optional<Timestamp> lost_since_;
};

}  // namespace docent::engine
