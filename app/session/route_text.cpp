// SPDX-License-Identifier: Apache-2.0
#include "app/session/route_text.h"

#include "app/session/visitor_strings.h"

namespace docent::app {

namespace {

// Of a stop, from 1.
std::string NumberOf(std::size_t stop) {
  return std::to_string(stop + 1);
}

// Before the first stop.
std::string RouteBegin(const Route& route) {
  namespace text = visitor_strings;
  std::string contents = route.stops.size() == 1
                             ? std::string(text::kOneStop)
                             : text::Filled(text::kStops, {std::to_string(route.stops.size())});
  if (route.minutes > 0)
    contents = text::Filled(text::kAboutMinutes, {contents, std::to_string(route.minutes)});
  return text::Filled(text::kFirstStop, {contents, route.stops.front().name});
}

std::string RouteEnd(const RouteState& state) {
  namespace text = visitor_strings;
  const std::size_t seen = state.CountSeen(), stops = state.route().stops.size();
  if (seen < stops) return text::Filled(text::kSawSome, {std::to_string(seen), std::to_string(stops)});
  return stops == 1 ? std::string(text::kSawOnly) : text::Filled(text::kSawAll, {std::to_string(stops)});
}

}  // namespace

std::string RouteLine(const RouteState& state) {
  namespace text = visitor_strings;
  const std::optional<std::size_t> target = state.Target(), here = state.Here();
  if (!target) return RouteEnd(state);
  const std::string name = state.route().stops[*target].name,
                    count = std::to_string(state.route().stops.size());
  if (state.is_going_back()) return text::Filled(text::kBackTo, {name, NumberOf(*target), count});
  if (here) return text::Filled(text::kStopAndNext, {NumberOf(*here), count, name});
  if (*target == 0) return RouteBegin(state.route());
  return text::Filled(text::kNext, {name, NumberOf(*target), count});
}

std::vector<std::string> RouteList(const RouteState& state) {
  namespace text = visitor_strings;
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < state.route().stops.size(); ++i) {
    const char* line = text::kNumberedStop;
    if (state.visit(i) == RouteState::Visit::kSeen) line = text::kSeenStop;
    if (state.visit(i) == RouteState::Visit::kSkipped) line = text::kSkippedStop;
    if (state.Target() == i) line = text::kNextStop;
    lines.push_back(text::Filled(line, {NumberOf(i), state.route().stops[i].name}));
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
