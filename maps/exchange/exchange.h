// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "maps/library/library.h"

// Copies maps between libraries with their content, policies and bounds, but without the undo history of the
// content. With functions for scenes, signposts lead to the same maps in the other library, if they are
// there. Tours come along with all maps of a library, but not with one map.
namespace docent::maps {

// Writes a new library that contains only this map. Throws docent::Error when the file already exists or the
// map is invalid; then no file is left.
void ExportMap(const Library& library, std::uint64_t key, const std::filesystem::path& path,
               const SceneTools& scenes = {});

// A map or tour that was imported.
struct ImportedName {
  std::string name, name_before;  // They differ if the library already had one with that name.
};
// What an import added, in the order of the library that it comes from.
struct Imported {
  std::vector<ImportedName> maps, tours;
};
// Adds all maps and tours of a library to the library at `path`, which is created if it does not exist. A
// name that is taken gets a number: "Desk" becomes "Desk (2)". Nothing is written before every map and tour
// was read and validated. Throws docent::Error; maps that were added before an error stay.
Imported ImportMaps(const Library& from, const std::filesystem::path& path, const SceneTools& scenes = {});

}  // namespace docent::maps
