// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "maps/database.h"

// The tables of a library (maps/README.md describes them) and the marks by which a file is known to be one.
namespace docent::maps {

inline constexpr std::int64_t kApplicationId = 0x446F6374;  // "Doct", PRAGMA application_id
inline constexpr std::int64_t kSchemaVersion = 3;           // PRAGMA user_version
inline constexpr std::int64_t kThumbnailsSince = 2;         // the first format with the table of thumbnails
inline constexpr std::int64_t kWordsSince = 3;              // the first format with the table of words
inline constexpr std::int64_t kPanoramasSince = 2;          // the first format with the part `panoramas`

// Whether the file holds nothing at all yet, as after it was created.
bool IsBlank(const Database& database);
// Writes the tables into a blank file, in one transaction. Does nothing when another process was faster.
void CreateSchema(const Database& database);
// The format that the file has; what this program does not know is refused by CheckIsLibrary.
std::int64_t SchemaVersion(const Database& database);
void SetSchemaVersion(const Database& database, std::int64_t version);
// One table by its name, inside the caller's transaction.
void CreateTable(const Database& database, std::string_view name);
// Throws docent::Error with one sentence when the file is not a library, is of a newer version, or has other
// tables than a library of its format has. Reads only.
void CheckIsLibrary(const Database& database);

}  // namespace docent::maps
