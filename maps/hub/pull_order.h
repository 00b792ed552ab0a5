// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "maps/hub/hub.h"

// In which order a device brings maps in: those near the visitor first. Pure functions; any thread.
namespace docent::maps {

// Pairs of ids of maps between which a visitor goes, in either direction.
using WaysBetweenMaps = std::vector<std::pair<std::string, std::string>>;

// The ways between the stops of tours, from each to the next.
WaysBetweenMaps WaysOfTours(const std::vector<HubTour>& tours);

// Orders the maps by the number of ways that a visitor who is in the maps `from` has to go to them. Equally
// near ones, and those that no way leads to, keep their order; the latter come last.
std::vector<HubHead> NearestFirst(std::vector<HubHead> heads, const std::vector<std::string>& from,
                                  const WaysBetweenMaps& ways);

}  // namespace docent::maps
