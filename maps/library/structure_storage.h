// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

// Writes keyframes, points and observations of a map, with the appearance that the place index needs. The
// functions run in a transaction of the caller, and throw docent::Error.
namespace docent::maps {

MapParts PartsOf(const engine::MapSnapshot& snapshot);
// The bounds of these keyframes and points; throws if there are no keyframes.
Bounds BoundsOf(const MapParts& parts);

// Writes the snapshot without its images, of which `parts` are the parts, and enters in `info` what belongs
// to it. stored_before: the keyframes whose visual words are stored already.
void WriteStructure(const Database& database, const engine::MapSnapshot& snapshot, const MapParts& parts,
                    const std::vector<StoredKeyFrame>& stored_before, MapInfo* info);
// Stores a snapshot with its images if it differs from the stored one, and returns whether it does. Throws if
// the policy of the map forbids it.
bool UpdateStructure(const Database& database, const engine::MapSnapshot& snapshot, MapInfo* info);

}  // namespace docent::maps
