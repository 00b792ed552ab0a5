// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_assignment.h"

#include <utility>

namespace docent::engine {

void MapAssignment::Start(std::uint64_t map, bool after_loss) {
  Enter(map);
  started_map_ = true;
  order_ = after_loss ? Order::kStartAfterLoss : Order::kStart;
}

void MapAssignment::WaitFor(std::uint64_t map) {
  Enter(map);
  started_map_ = false;
}

void MapAssignment::Enter(std::uint64_t map) {
  map_ = map;
  lost_since_.reset();
  order_ = Order::kEnter;
}

void MapAssignment::Leave() {
  map_ = 0;
  starting_ = false;
  lost_since_.reset();
  order_ = Order::kLeave;
}

void MapAssignment::SearchAgain() {
  if (order_ == Order::kNone) order_ = Order::kEnter;
}

void MapAssignment::FailStart(bool has_snapshot, bool after_loss) {
  if (!starting_) return;
  order_ = has_snapshot ? Order::kStartAgain : after_loss ? Order::kStartAfterLoss : Order::kStart;
}

void MapAssignment::SetLost(Timestamp time) {
  if (!lost_since_) lost_since_ = time;
}

MapAssignment::Order MapAssignment::TakeOrder(bool has_finite_points) {
  const Order order = std::exchange(order_, Order::kNone);
  if (order == Order::kStart || order == Order::kStartAfterLoss || order == Order::kGiveDepth)
    starting_ = true;
  if (order == Order::kLeave || order == Order::kEnter) starting_ = false;
  // A map without finite points still waits for its initialization.
  if (has_finite_points) starting_ = false;
  return order;
}

}  // namespace docent::engine
