// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

// Records of visits on a hub: devices hand them in, curators collect them. Their files are those of
// `docent tour --log`, visits-DAY.jsonl with a record a line. The functions throw docent::Error.
namespace docent::maps {

// What HandInVisits has done.
struct HandedInVisits {
  std::size_t added = 0;    // Records that the hub did not have.
  std::size_t skipped = 0;  // Lines that are no record.
};
// Hands in the records of a folder. The files stay; records that the hub has are not added again.
HandedInVisits HandInVisits(const std::string& url, const std::filesystem::path& folder);

// Adds the records of a hub to the files of a folder, which is created if needed; those that are there are
// left out. Returns how many were added. Only curators and admins may read them.
std::size_t CollectVisits(const std::string& url, const std::filesystem::path& folder);

}  // namespace docent::maps
