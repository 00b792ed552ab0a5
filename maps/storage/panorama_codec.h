// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "maps/storage/map_codec.h"

// Encodes the part `panoramas` of a map: its panorama maps and the keyframes and points that belong to them
// (hybrid-slam §2). It is a separate part, because format 1 did not have panorama maps and few maps have
// many.
namespace docent::maps {

Bytes EncodePanoramas(std::uint64_t map_key, const MapParts& parts);
// What is done with a member that `parts` does not have.
enum class MissingMember { kRefuse, kLeaveOut };
// Decodes into `parts`, whose keyframes and points must already be those that were encoded, or some of them
// if missing ones are left out. Throws docent::Error.
void DecodePanoramas(std::uint64_t map_key, std::span<const std::uint8_t> bytes, MapParts* parts,
                     MissingMember missing = MissingMember::kRefuse);

}  // namespace docent::maps
