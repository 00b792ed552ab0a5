// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace docent::maps {

// Saves everything that a hub has to one file, as of one moment, with pg_dump. Devices go on meanwhile. Only
// whoever made the hub may read everything. Throws docent::Error, also if the file exists; then there is
// none.
void BackUpHub(const std::string& url, const std::filesystem::path& file);

// Makes a hub of a backup with pg_restore, in a database that has no hub or one that was never used; it is
// created if it does not exist. Returns the users of the backup whom this server does not know: they belong
// to the server and are to be added anew. Throws docent::Error; then the database has no hub.
std::vector<std::string> RestoreHub(const std::string& url, const std::filesystem::path& file);

}  // namespace docent::maps
