// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "maps/map_codec.h"

// The part `panoramas` of a map: its panorama maps, and which keyframes and points belong to them
// (hybrid-slam §2). A part of its own, because format 1 knew none and few maps have many.
namespace docent::maps {

Bytes EncodePanoramas(std::uint64_t map_key, const MapParts& parts);
// Into parts that have their keyframes and points already, as they were encoded. Throws docent::Error.
void DecodePanoramas(std::uint64_t map_key, std::span<const std::uint8_t> bytes, MapParts* parts);

}  // namespace docent::maps
