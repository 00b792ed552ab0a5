// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "content/scene.h"
#include "maps/hub/map_facts.h"
#include "maps/hub/sync.h"
#include "maps/library/library.h"
#include "tests/maps/map_samples.h"

// Libraries with real scenes for the tests of hubs.
namespace docent::maps {

// Options to exchange a library with a hub, with the functions of the program for scenes.
SyncOptions SampleSync(const std::string& hub, const std::filesystem::path& library);
// Opens a library with the same functions.
Library OpenSampleLibrary(const std::filesystem::path& file);
// Adds a map with random keyframes and a signpost; returns its key.
std::uint64_t AddSampleMap(Library* library, const std::string& name, std::uint64_t seed,
                           Policy policy = Policy::kOpen);
// Changes the scene of a map.
void EditScene(Library* library, std::uint64_t key, const std::function<void(content::Scene*)>& edit);
content::Scene SceneIn(const Library& library, std::uint64_t key);
// A signpost with a name and a text.
content::Entity SampleSignpost(const std::string& name, const std::string& text);
// Adds such a signpost to the map of this name in a library.
void AddSampleSignpost(const std::filesystem::path& library, const std::string& map, const std::string& name,
                       const std::string& text);
// Adds a keyframe to a map at this place.
void ExtendMap(Library* library, std::uint64_t key, const Eigen::Vector3d& place, std::uint64_t seed);
// The names of the entities with their texts: "sign-1=Hello sign-2=Bye".
std::string TextsIn(const Library& library, std::uint64_t key);
// The names of the maps of a library, sorted and separated by commas.
std::string NamesIn(const Library& library);
// The first difference between the maps of that name in two libraries; empty if they are equal.
std::string DifferenceOf(const std::string& name, const std::filesystem::path& a,
                         const std::filesystem::path& b);
// All lines of a report, each with a line end.
std::string LinesOf(const SyncReport& report);

}  // namespace docent::maps
