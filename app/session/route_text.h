// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/session/route_state.h"
#include "app/session/visitor_strings.h"

// A visitor's way along a tour in words.
namespace docent::app {

// How far the visitor has come and where they are led: "Stop 3 of 8. Next: Lions".
std::string RouteLine(const RouteState& state, const VisitorStrings& strings = VisitorStringsFor(""));
// A line for each stop, with what became of it: "2. Lions (seen)".
std::vector<std::string> RouteList(const RouteState& state,
                                   const VisitorStrings& strings = VisitorStringsFor(""));

// The detail of an event in events.csv, in English: "arrived at 'Lions', stop 3 of 8".
std::string TextOf(const RouteEvent& event, const RouteState& state);

}  // namespace docent::app
