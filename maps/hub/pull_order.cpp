// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/pull_order.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <map>

namespace docent::maps {

WaysBetweenMaps WaysOfTours(const std::vector<HubTour>& tours) {
  WaysBetweenMaps ways;
  for (const HubTour& tour : tours) {
    if (tour.removed) continue;
    for (std::size_t i = 1; i < tour.stops.size(); ++i) ways.emplace_back(tour.stops[i - 1], tour.stops[i]);
  }
  return ways;
}

std::vector<HubHead> NearestFirst(std::vector<HubHead> heads, const std::vector<std::string>& from,
                                  const WaysBetweenMaps& ways) {
  std::multimap<std::string, std::string> next;
  for (const auto& [a, b] : ways) {
    next.emplace(a, b);
    next.emplace(b, a);
  }
  std::map<std::string, std::size_t> steps;
  std::deque<std::string> queue;
  for (const std::string& id : from) {
    if (steps.emplace(id, 0).second) queue.push_back(id);
  }
  for (; !queue.empty(); queue.pop_front()) {
    const std::size_t step = steps.at(queue.front()) + 1;
    const auto [begin, end] = next.equal_range(queue.front());
    for (auto way = begin; way != end; ++way) {
      if (steps.emplace(way->second, step).second) queue.push_back(way->second);
    }
  }
  const auto steps_to = [&](const HubHead& head) {
    const auto found = steps.find(head.id);
    return found == steps.end() ? std::numeric_limits<std::size_t>::max() : found->second;
  };
  std::stable_sort(heads.begin(), heads.end(),
                   [&](const HubHead& a, const HubHead& b) { return steps_to(a) < steps_to(b); });
  return heads;
}

}  // namespace docent::maps
