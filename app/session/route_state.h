// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/session/signpost_graph.h"

namespace docent::app {

// A stop of a tour.
struct RouteStop {
  std::uint64_t key = 0;  // Of its map.
  std::string name;       // Of its map.
};

// A tour that a visitor is led along.
struct Route {
  std::vector<RouteStop> stops;  // At least one, in their order, each map once.
  SignpostGraph signposts;       // Of the library.
  int minutes = 0;               // How long it takes; 0 if that is not known.
};

// What happened on a tour.
struct RouteEvent {
  enum class Kind {
    kArrived,    // The visitor was recognized at the stop.
    kSkipped,    // The visitor passes over the stop.
    kGoingBack,  // The visitor asked to be led back to the stop,
    kGoingOn,    // or, on the way back, to be led on to the stop.
    kFinished,   // No stop is left; `stop` does not count.
  };
  Kind kind = Kind::kArrived;
  std::size_t stop = 0;  // Index in Route::stops.

  bool operator==(const RouteEvent&) const = default;
};

// How far a visitor has come on a tour, and where they are led next. They are led from stop to stop in the
// order of the tour. A visitor who stays at a later stop has skipped those in between, unless the signposts
// to the next stop lead through that map. Several cameras may belong to the visitor. One thread.
class RouteState {
 public:
  enum class Visit { kAhead, kSeen, kSkipped };

  // A later stop can be seen from afar, or crossed; only a visitor who is there for this long has come to it.
  // A longer pause without a pose interrupts the stay.
  static constexpr double kStay_s = 3, kPause_s = 1;

  explicit RouteState(Route route);

  // An image of a camera with a pose in the map of this key, and one without a pose. Times do not decrease. A
  // camera without a pose takes the visitor away only if no other one has had a pose since its own last one,
  // or none for kPause_s.
  void Enter(std::uint64_t map_key, double seconds, int camera = 0);
  void Leave(double seconds = 0, int camera = 0);
  // Passes over the stop that the visitor is led to; on the way back to a stop, ends the way back. False if
  // no stop is left.
  bool Skip();
  // Leads the visitor to the stop before the one that they are led to, leaving out the one where they are;
  // further back each time. False if there is none.
  bool GoBack();

  const Route& route() const { return route_; }
  Visit visit(std::size_t stop) const { return visits_.at(stop); }
  std::size_t CountSeen() const;
  // The stop that the visitor is led to; empty when the tour is finished.
  std::optional<std::size_t> Target() const;
  // The stop where the visitor is; empty on the way between stops, and while it is not known.
  std::optional<std::size_t> Here() const { return here_ == 0 ? std::nullopt : StopOf(here_); }
  bool is_going_back() const { return back_.has_value(); }
  // Whether somebody who is led anew would notice a difference.
  bool is_begun() const { return back_ || FirstAhead() != std::optional<std::size_t>(0); }
  // Whether the tour was finished, and the camera is back at the first stop: it is in the hands of the next
  // visitor, or of one who may see it all again.
  bool HasReturned() const;
  // The least number of signposts that lead from a map to the target; empty if none lead there.
  std::optional<int> SignpostsFrom(std::uint64_t map_key) const;
  // What happened since the last call, in its order.
  std::vector<RouteEvent> TakeEvents() { return std::exchange(events_, {}); }

 private:
  std::optional<std::size_t> StopOf(std::uint64_t map_key) const;
  std::optional<std::size_t> FirstAhead() const;
  void Arrive(std::size_t stop);
  void SkipStopsBefore(std::size_t stop);
  void UpdateTarget();

  const Route route_;
  std::vector<Visit> visits_;               // By stop. Those that are ahead come last.
  std::optional<std::size_t> back_;         // The stop that the visitor is led back to.
  std::map<std::uint64_t, int> distances_;  // To the target, as SignpostGraph has them.
  std::uint64_t here_ = 0, last_ = 0;       // The map of the last image, if it had a pose; the last map.
  double entered_s_ = 0;     // When the visitor came to the last map, or was found there again.
  double last_s_ = 0;        // The time of the last image with a pose,
  int camera_ = 0;           // and its camera.
  bool is_passing_ = false;  // Whether the last map lies on the way to the target.
  bool is_finished_ = false;
  bool was_elsewhere_ = false;  // At another stop than the first, since the tour was finished.
  std::vector<RouteEvent> events_;
};

}  // namespace docent::app
