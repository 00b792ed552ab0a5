// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "engine/map/map_snapshot.h"
#include "maps/library/library.h"

// What the fuzzers of libraries change: small valid maps, in files that are gone with the process.
namespace docent::fuzz {

// A folder of this process, in memory where there is room, which is removed at its exit.
std::filesystem::path TemporaryFolder();
// Two keyframes with two points. Their images have keypoints, so that the table of words is not empty.
std::shared_ptr<const engine::MapSnapshot> SmallMap();
// A scene without entities, with one asset of 20 bytes.
std::shared_ptr<const maps::SceneRecord> SmallScene();

}  // namespace docent::fuzz
