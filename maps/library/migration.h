// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "maps/storage/database.h"
#include "maps/storage/scene_tools.h"

// Upgrades a library of an older format to the current one. Before anything is changed, the file is copied to
// NAME.docent.format-N in the same folder, and the copy is flushed to disk. The upgrade is one transaction,
// so that a crash leaves either the old or the new format. A library is upgraded when it is opened for
// writing; when it is opened read-only, the older format is read directly.
namespace docent::maps {

// Does nothing when the format is current. Throws docent::Error, with the file unchanged, when the copy or
// the upgrade fails because the disk is full, the folder is read-only or a map is damaged.
// Without functions for scenes, signposts keep leading to maps by name.
void UpgradeFormat(const Database& database, const SceneTools& scenes);

// The path of the copy that an upgrade from this format makes.
std::filesystem::path BackupPath(const std::filesystem::path& library, std::int64_t format);

}  // namespace docent::maps
