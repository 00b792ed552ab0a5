// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/session/visitor_strings.h"
#include "ui/renderer.h"

namespace docent::app {

// Times of a visit, in seconds. They are design choices, each for the reason given.
struct VisitTimes {
  double arrival = 2.5;  // A place is announced for this long, enough to read two short words twice.
  double fade = 0.4;     // The announcement appears and disappears within this time.
  // A visitor who is not recognized within this time is shown the entrances of the likeliest places: most are
  // recognized sooner.
  double entrances = 1.5;
  // The welcome stays for this long, enough to read it; that nothing is recognized yet is not said before.
  double welcome = 4;
  double held = 0.5;    // After a loss the content stays where it was for this long: a hand that passes.
  double way_back = 5;  // Searching longer than this, the visitor is led to known views,
  double stops = 30;    // and longer than this, all places are listed.
};

// What a visitor on a tour is told, by what was recognized so far: a welcome, where they are, or how to be
// recognized again. One camera; times are those of its images and do not decrease. One thread.
class VisitState {
 public:
  // `stops`: the names of the places of the library. `strings` is one of the constants behind
  // VisitorStringsFor.
  explicit VisitState(std::vector<std::string> stops, const VisitorStrings& strings = VisitorStringsFor(""),
                      const VisitTimes& times = {})
      : stops_(std::move(stops)), strings_(strings), times_(times) {}

  // A frame at this time, with a pose in the map of this name, or without a pose if it is empty. `hint` is
  // what to do so that the camera is tracked in this frame; empty for nothing.
  ui::VisitorDisplay Update(double seconds, const std::string& place, const std::string& hint);
  // Whether a visitor who searches at this time is helped by views of known places, as the display should
  // have them: after a while, and until all places are listed.
  bool WantsViews(double seconds) const;
  // Whether a visitor who was not recognized yet is helped by the entrances of places at this time.
  bool WantsEntrances(double seconds) const;

  // Whether a visitor is still to read the welcome.
  bool Welcomes(double seconds) const {
    return begin_ && place_.empty() && !stops_.empty() && Searched(seconds) < times_.welcome;
  }
  // Whether the content of the last frame with a pose is still to be drawn.
  bool HoldsContent(double seconds) const { return last_pose_ && seconds - *last_pose_ <= times_.held; }

 private:
  ui::VisitorDisplay Search(double seconds, const std::string& hint) const;
  double Searched(double seconds) const {
    return seconds - (last_pose_ ? *last_pose_ + times_.held : *begin_);
  }

  const std::vector<std::string> stops_;
  const VisitorStrings& strings_;
  const VisitTimes times_;
  std::string place_;  // The last one; empty before the first.
  std::optional<double> begin_, arrival_, last_pose_;
};

}  // namespace docent::app
