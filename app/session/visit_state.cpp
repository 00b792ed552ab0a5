// SPDX-License-Identifier: Apache-2.0
#include "app/session/visit_state.h"

#include <algorithm>

namespace docent::app {

namespace {

// 0 outside [0, length]; rises and falls linearly within `fade` of the ends.
double Opacity(double time, double length, double fade) {
  return std::clamp(std::min(time, length - time) / fade, 0.0, 1.0);
}

}  // namespace

ui::VisitorDisplay VisitState::Update(double seconds, const std::string& place, const std::string& hint) {
  if (!begin_) begin_ = seconds;
  if (place.empty() && !HoldsContent(seconds)) return Search(seconds, hint);
  if (!place.empty()) {
    if (place != place_) arrival_ = seconds;
    place_ = place;
    last_pose_ = seconds;
  }
  ui::VisitorDisplay display;
  display.is_right_to_left = strings_.is_right_to_left;
  display.place = place_;
  if (!place.empty()) display.sentence = hint;
  if (arrival_) display.arrival = Opacity(seconds - *arrival_, times_.arrival, times_.fade);
  return display;
}

bool VisitState::WantsViews(double seconds) const {
  if (!begin_ || HoldsContent(seconds)) return false;
  const double searched = Searched(seconds);
  return !stops_.empty() && searched >= times_.way_back && searched < times_.stops;
}

bool VisitState::WantsEntrances(double seconds) const {
  if (!begin_ || !place_.empty() || stops_.empty()) return false;
  const double searched = Searched(seconds);
  return searched >= times_.entrances && searched < times_.way_back;
}

ui::VisitorDisplay VisitState::Search(double seconds, const std::string& hint) const {
  ui::VisitorDisplay display;
  display.is_right_to_left = strings_.is_right_to_left;
  display.is_searching = true;
  if (stops_.empty()) {
    display.sentence = strings_.no_places;
    return display;
  }
  const double searched = Searched(seconds);
  if (searched >= times_.stops) {
    display.stops = stops_;
    display.sentence = strings_.go_to_a_place;
  } else if (Welcomes(seconds) && hint == strings_.not_recognized) {
    display.sentence = strings_.welcome;
  } else if (!hint.empty()) {
    display.sentence = hint;
  } else if (place_.empty()) {
    display.sentence = strings_.welcome;
  } else if (searched >= times_.way_back) {
    display.sentence = Filled(strings_, strings_.go_back_to, {place_});
  } else {
    display.sentence = strings_.look_around;
  }
  return display;
}

}  // namespace docent::app
