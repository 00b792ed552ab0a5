// SPDX-License-Identifier: Apache-2.0
#include "app/session/signpost_graph.h"

#include <deque>

namespace docent::app {

std::map<std::uint64_t, int> SignpostGraph::DistancesTo(std::uint64_t to) const {
  std::map<std::uint64_t, int> distances = {{to, 0}};
  // Breadth first, against the direction of the signposts.
  for (std::deque<std::uint64_t> open = {to}; !open.empty(); open.pop_front()) {
    const auto signposts = from_.find(open.front());
    if (signposts == from_.end()) continue;
    const int distance = distances.at(open.front()) + 1;
    for (const std::uint64_t from : signposts->second) {
      if (distances.emplace(from, distance).second) open.push_back(from);
    }
  }
  return distances;
}

}  // namespace docent::app
