// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace docent::app {

// Which maps the signposts of which maps lead to.
class SignpostGraph {
 public:
  // Adds a signpost in the map `from` that leads to the map `to`.
  void Add(std::uint64_t from, std::uint64_t to) { from_[to].push_back(from); }

  // The least number of signposts that lead from each map to the map `to`, by the key of the map. Maps from
  // which none lead there are left out; `to` itself has 0.
  std::map<std::uint64_t, int> DistancesTo(std::uint64_t to) const;

 private:
  std::map<std::uint64_t, std::vector<std::uint64_t>> from_;  // Where signposts to a map stand.
};

}  // namespace docent::app
