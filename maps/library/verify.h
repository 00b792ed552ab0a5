// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "maps/storage/database.h"
#include "maps/storage/map_record.h"
#include "maps/storage/scene_tools.h"

namespace docent::maps {

// Reads, decodes and checks every row of a library, and its scenes as far as `scenes` can. Returns one
// sentence for each error; empty if there is none. The caller holds a read transaction, also below.
std::vector<std::string> VerifyAll(const Database& database, int threads, const SceneTools& scenes);

// The same for one map with its assets.
std::vector<std::string> VerifyMap(const Database& database, const MapInfo& info, int threads,
                                   const SceneTools& scenes);
// The same for the scene of one map with its assets.
std::vector<std::string> VerifyScene(const Database& database, const MapInfo& info, const SceneTools& scenes);

// One sentence for each signpost that leads to a map that does not exist; scenes that cannot be read are left
// out.
std::vector<std::string> SignpostsToNoMap(const Database& database, const SceneTools& scenes);

}  // namespace docent::maps
