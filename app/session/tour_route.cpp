// SPDX-License-Identifier: Apache-2.0
#include "app/session/tour_route.h"

#include <algorithm>
#include <vector>

#include "maps/library/map_copies.h"

namespace docent::app {

Route RouteOf(const maps::Library& library, const maps::Tour& tour) {
  const std::vector<maps::MapCopy> copies = maps::FindCopies(library);
  const auto replaced = maps::ReplacedByCopies(copies);
  const auto names = maps::NamesForVisitors(library.List(), copies);
  const auto shown = [&](std::uint64_t key) {
    const auto copy = replaced.find(key);
    return copy == replaced.end() ? key : copy->second;
  };
  Route route;
  route.minutes = tour.minutes;
  for (const std::uint64_t stop : tour.stops) {
    const std::uint64_t key = shown(stop);
    if (std::ranges::any_of(route.stops, [key](const RouteStop& other) { return other.key == key; }))
      continue;
    const std::string name = library.Find(key).name;
    const auto told = names.find(name);
    route.stops.push_back({key, told == names.end() ? name : told->second});
  }
  for (const maps::Library::Signpost& signpost : library.Signposts())
    route.signposts.Add(shown(signpost.map.key), shown(signpost.to_key));
  return route;
}

}  // namespace docent::app
