// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "maps/database.h"

// Bringing a library of an older format up to this program's. Before anything is changed the file is copied
// beside itself, as NAME.docent.format-N, and the copy is on disk; the change is one transaction, so that a
// crash leaves the old format or the new one. Libraries are upgraded when they are opened for writing; opened
// read only, an older format is read as it is.
namespace docent::maps {

// Does nothing when the format is this program's. Throws docent::Error, with the file unchanged, when the
// copy or the change cannot be made: the disk is full, the folder may not be written, a map is damaged.
void UpgradeFormat(const Database& database);

// The name of the copy that an upgrade from this format leaves.
std::filesystem::path BackupPath(const std::filesystem::path& library, std::int64_t format);

}  // namespace docent::maps
