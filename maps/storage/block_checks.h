// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "maps/storage/envelope.h"

// Checksums of the blocks of a binary column, so that the records in its intact blocks can be recovered when
// others are damaged; the checksum of the whole column only says that something is. All functions are pure.
namespace docent::maps {

inline constexpr std::size_t kCheckedBlockBytes = 4096;

// The name in the table `parts` of the checksums for the column `part`.
std::string BlockChecksOf(std::string_view part);

// The XXH64 of each block of a column; the last block may be shorter.
Bytes EncodeBlockChecks(std::uint64_t map_key, std::span<const std::uint8_t> column);

// A column with those records of a damaged one that lie in blocks whose checksum matches, in their order. The
// records of the kind must be of fixed length. Throws docent::Error when the checksums are damaged.
Bytes ConfirmedRecords(const EnvelopeKind& kind, std::uint64_t map_key, std::span<const std::uint8_t> column,
                       std::span<const std::uint8_t> checks);

}  // namespace docent::maps
