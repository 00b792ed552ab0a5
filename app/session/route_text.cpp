// SPDX-License-Identifier: Apache-2.0
#include "app/session/route_text.h"

namespace docent::app {

namespace {

// Of a stop, from 1.
std::string NumberOf(std::size_t stop) {
  return std::to_string(stop + 1);
}

// Before the first stop.
std::string RouteBegin(const Route& route, const VisitorStrings& text) {
  std::string contents = route.stops.size() == 1
                             ? std::string(text.one_stop)
                             : Filled(text, text.stops, {std::to_string(route.stops.size())});
  if (route.minutes > 0)
    contents = Filled(text, text.about_minutes, {contents, std::to_string(route.minutes)});
  return Filled(text, text.first_stop, {contents, route.stops.front().name});
}

std::string RouteEnd(const RouteState& state, const VisitorStrings& text) {
  const std::size_t seen = state.CountSeen(), stops = state.route().stops.size();
  if (seen < stops) return Filled(text, text.saw_some, {std::to_string(seen), std::to_string(stops)});
  return stops == 1 ? std::string(text.saw_only) : Filled(text, text.saw_all, {std::to_string(stops)});
}

}  // namespace

std::string RouteLine(const RouteState& state, const VisitorStrings& text) {
  const std::optional<std::size_t> target = state.Target(), here = state.Here();
  if (!target) return RouteEnd(state, text);
  const std::string name = state.route().stops[*target].name,
                    count = std::to_string(state.route().stops.size());
  if (state.is_going_back()) return Filled(text, text.back_to, {name, NumberOf(*target), count});
  if (here) return Filled(text, text.stop_and_next, {NumberOf(*here), count, name});
  if (*target == 0) return RouteBegin(state.route(), text);
  return Filled(text, text.next, {name, NumberOf(*target), count});
}

std::vector<std::string> RouteList(const RouteState& state, const VisitorStrings& text) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < state.route().stops.size(); ++i) {
    const char* line = text.numbered_stop;
    if (state.visit(i) == RouteState::Visit::kSeen) line = text.seen_stop;
    if (state.visit(i) == RouteState::Visit::kSkipped) line = text.skipped_stop;
    if (state.Target() == i) line = text.next_stop;
    lines.push_back(Filled(text, line, {NumberOf(i), state.route().stops[i].name}));
  }
  return lines;
}

std::string TextOf(const RouteEvent& event, const RouteState& state) {
  using Kind = RouteEvent::Kind;
  const std::vector<RouteStop>& stops = state.route().stops;
  const std::string count = std::to_string(stops.size());
  const std::string stop =
      "'" + stops.at(event.stop).name + "', stop " + NumberOf(event.stop) + " of " + count;
  switch (event.kind) {
    case Kind::kArrived:
      return "arrived at " + stop;
    case Kind::kSkipped:
      return "skipped " + stop;
    case Kind::kGoingBack:
      return "going back to " + stop;
    case Kind::kGoingOn:
      return "going on to " + stop;
    case Kind::kFinished:
      return "finished; " + std::to_string(state.CountSeen()) + " of " + count + " stops seen";
  }
  return "";
}

}  // namespace docent::app
