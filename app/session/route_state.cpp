// SPDX-License-Identifier: Apache-2.0
#include "app/session/route_state.h"

#include <algorithm>

namespace docent::app {

RouteState::RouteState(Route route) : route_(std::move(route)), visits_(route_.stops.size(), Visit::kAhead) {
  UpdateTarget();
}

void RouteState::Enter(std::uint64_t map_key, double seconds, int camera) {
  if (map_key != last_) {
    const auto before = SignpostsFrom(last_), now = SignpostsFrom(map_key);
    is_passing_ = before && now && *now<*before&& * now> 0;
    last_ = map_key;
    entered_s_ = seconds;
  } else if (seconds - last_s_ > kPause_s) {
    entered_s_ = seconds;
  }
  last_s_ = seconds;
  camera_ = camera;
  here_ = map_key;
  const std::optional<std::size_t> stop = StopOf(map_key);
  if (!stop) return;
  was_elsewhere_ = is_finished_ && (was_elsewhere_ || *stop != 0);
  const bool is_later = visits_[*stop] == Visit::kAhead && FirstAhead() != stop;
  if (is_later && (is_passing_ || seconds - entered_s_ < kStay_s)) return;
  if (visits_[*stop] != Visit::kSeen || back_ == stop) Arrive(*stop);
}

void RouteState::Leave(double seconds, int camera) {
  if (camera == camera_ || seconds - last_s_ > kPause_s) here_ = 0;
}

void RouteState::Arrive(std::size_t stop) {
  if (visits_[stop] == Visit::kAhead) {
    SkipStopsBefore(stop);
    back_.reset();
  }
  if (back_ == stop) {
    back_.reset();
    was_elsewhere_ = false;  // The same visitor wanted to come here.
  }
  visits_[stop] = Visit::kSeen;
  events_.push_back({RouteEvent::Kind::kArrived, stop});
  UpdateTarget();
}

void RouteState::SkipStopsBefore(std::size_t stop) {
  for (std::size_t i = 0; i < stop; ++i) {
    if (visits_[i] != Visit::kAhead) continue;
    visits_[i] = Visit::kSkipped;
    events_.push_back({RouteEvent::Kind::kSkipped, i});
  }
}

bool RouteState::Skip() {
  const std::optional<std::size_t> next = FirstAhead();
  if (back_) {
    back_.reset();
    if (next) events_.push_back({RouteEvent::Kind::kGoingOn, *next});
  } else if (next) {
    SkipStopsBefore(*next + 1);
  } else {
    return false;
  }
  UpdateTarget();
  return true;
}

bool RouteState::GoBack() {
  std::size_t stop = Target().value_or(visits_.size());
  while (stop > 0 && route_.stops[stop - 1].key == here_) --stop;
  if (stop == 0) return false;
  back_ = stop - 1;
  events_.push_back({RouteEvent::Kind::kGoingBack, *back_});
  UpdateTarget();
  return true;
}

bool RouteState::HasReturned() const {
  return was_elsewhere_ && !back_ && Here() == std::optional<std::size_t>(0) &&
         last_s_ - entered_s_ >= kStay_s;
}

std::size_t RouteState::CountSeen() const {
  return static_cast<std::size_t>(std::count(visits_.begin(), visits_.end(), Visit::kSeen));
}

std::optional<std::size_t> RouteState::Target() const {
  return back_ ? back_ : FirstAhead();
}

std::optional<int> RouteState::SignpostsFrom(std::uint64_t map_key) const {
  const auto found = distances_.find(map_key);
  return found == distances_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<std::size_t> RouteState::StopOf(std::uint64_t map_key) const {
  const auto found = std::find_if(route_.stops.begin(), route_.stops.end(),
                                  [&](const RouteStop& stop) { return stop.key == map_key; });
  if (found == route_.stops.end()) return std::nullopt;
  return static_cast<std::size_t>(found - route_.stops.begin());
}

std::optional<std::size_t> RouteState::FirstAhead() const {
  const auto found = std::find(visits_.begin(), visits_.end(), Visit::kAhead);
  if (found == visits_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - visits_.begin());
}

void RouteState::UpdateTarget() {
  const std::optional<std::size_t> target = Target();
  distances_.clear();
  if (target) distances_ = route_.signposts.DistancesTo(route_.stops[*target].key);
  if (!std::exchange(is_finished_, !FirstAhead()) && is_finished_)
    events_.push_back({RouteEvent::Kind::kFinished, 0});
}

}  // namespace docent::app
