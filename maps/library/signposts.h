// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "maps/storage/map_record.h"
#include "maps/storage/scene_tools.h"

// To which maps signposts lead. Pure functions.
namespace docent::maps {

// Whether a signpost leads to this map: by its key, or by its name if it was written without a key.
bool LeadsTo(const SignpostTarget& target, const MapInfo& map);
// Whether it leads somewhere, but to none of these maps.
bool LeadsToNoMap(const SignpostTarget& target, const std::vector<MapInfo>& maps);
// The key and the name of the one of these maps that a target without a key leads to by its name; empty if it
// has a key or there is no such map.
std::optional<SignpostTarget> KeyOfTarget(const SignpostTarget& target, const std::vector<MapInfo>& maps);

}  // namespace docent::maps
