// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "maps/library/library.h"

namespace docent::maps {

// Two maps of a library of which one was made from the other, as by importing it twice: at least half of the
// keyframes of the smaller one have the same thumbnail in the other. A lost camera could not tell them apart.
struct MapCopy {
  MapInfo older;  // By the time of its last change; of equal times, the one that was added before.
  MapInfo newer;  // Of several copies, the newest.
};

// By ascending key of the older map. Reads the appearance of all maps, but no images. Thread-safe.
std::vector<MapCopy> FindCopies(const Library& library);

// The keys of older copies, each with that of the newest one.
std::map<std::uint64_t, std::uint64_t> ReplacedByCopies(const std::vector<MapCopy>& copies);

// A sentence for a curator who should keep one of the two.
std::string TextOf(const MapCopy& copy);

}  // namespace docent::maps
