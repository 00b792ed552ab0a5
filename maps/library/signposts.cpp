// SPDX-License-Identifier: Apache-2.0
#include "maps/library/signposts.h"

#include <algorithm>

namespace docent::maps {

bool LeadsTo(const SignpostTarget& target, const MapInfo& map) {
  return target.key != 0 ? target.key == map.key : !target.map.empty() && target.map == map.name;
}

bool LeadsToNoMap(const SignpostTarget& target, const std::vector<MapInfo>& maps) {
  if (target.key == 0 && target.map.empty()) return false;
  return std::none_of(maps.begin(), maps.end(), [&](const MapInfo& map) { return LeadsTo(target, map); });
}

std::optional<SignpostTarget> KeyOfTarget(const SignpostTarget& target, const std::vector<MapInfo>& maps) {
  if (target.key != 0) return std::nullopt;
  const auto found =
      std::find_if(maps.begin(), maps.end(), [&](const MapInfo& map) { return LeadsTo(target, map); });
  if (found == maps.end()) return std::nullopt;
  return SignpostTarget{found->key, found->name};
}

}  // namespace docent::maps
