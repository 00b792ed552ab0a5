// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "maps/library.h"

// Maps on their way between libraries, with everything that stands in them, their policies and bounds.
namespace docent::maps {

// Writes a new library that holds this map alone. Throws docent::Error when the file is there already or the
// map does not hold; then no file is left.
void ExportMap(const Library& library, std::uint64_t key, const std::filesystem::path& path);

struct ImportedMap {
  std::string name, name_before;  // different where the library had a map of that name
};
// Adds all maps of a library to the one at `path`, which is made where it is missing: "Desk" becomes "Desk
// (2)" where there is one. Nothing is written before each map was read and found whole. Throws docent::Error;
// maps that were added before a fault stay.
std::vector<ImportedMap> ImportMaps(const Library& from, const std::filesystem::path& path);

}  // namespace docent::maps
