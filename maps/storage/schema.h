// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "maps/storage/database.h"

// The tables of a library (described in maps/README.md) and the marks that identify its file format.
namespace docent::maps {

inline constexpr std::int64_t kApplicationId = 0x446F6374;  // "Doct", PRAGMA application_id
inline constexpr std::int64_t kSchemaVersion = 6;           // PRAGMA user_version
inline constexpr std::int64_t kThumbnailsSince = 2;         // The first format with the table `thumbnails`.
inline constexpr std::int64_t kWordsSince = 3;              // The first format with the table `words`.
inline constexpr std::int64_t kLensesSince = 4;             // The first format with the table `lenses`.
inline constexpr std::int64_t kBlockChecksSince = 5;        // The first format with checksums of blocks.
inline constexpr std::int64_t kToursSince = 6;              // The first format with the table `tours`.
inline constexpr std::int64_t kPanoramasSince = 2;          // The first format with the part `panoramas`.

// Whether the file is still empty, as after its creation.
bool IsBlank(const Database& database);
// Creates the tables in an empty file, in one transaction. Does nothing if another process did so first.
void CreateSchema(const Database& database);
// Returns the file's format version; CheckIsLibrary rejects unknown versions.
std::int64_t SchemaVersion(const Database& database);
void SetSchemaVersion(const Database& database, std::int64_t version);
// Creates one table by its name, inside the caller's transaction.
void CreateTable(const Database& database, std::string_view name);
// Throws docent::Error with a one-sentence message when the file is not a library, has a newer format, or has
// other tables than a library of its format. Only reads.
void CheckIsLibrary(const Database& database);

}  // namespace docent::maps
