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

// What visitors read instead of the names that tell copies apart: importing a map twice gives the second one
// the name of the first with a number, and the newest one is shown with that name alone. The first one gets
// the name with the number, so that names stay unique. If the first one was removed, the name without the
// number is free. `maps`: all of the library. By the name in the library; names that stay are left out.
std::map<std::string, std::string> NamesForVisitors(const std::vector<MapInfo>& maps,
                                                    const std::vector<MapCopy>& copies);

// A sentence for a curator who should keep one of the two.
std::string TextOf(const MapCopy& copy);

}  // namespace docent::maps
