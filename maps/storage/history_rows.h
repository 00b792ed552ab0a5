// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

// The part `history` of a map: the changes of its scene that can be undone, as text that only the content
// library interprets, and the assets that it refers to. It belongs to one state of the scene, of which it has
// a checksum, and says nothing about others. The functions run in a transaction of the caller, and throw
// docent::Error.
namespace docent::maps {

struct HistoryPart {
  std::uint64_t scene = 0;  // SceneTextChecksum.
  ScenePart changes;        // The history's text and the ids of its assets.

  bool operator==(const HistoryPart& other) const = default;
};

// The encoding throws when the text is longer than kMaxHistoryTextBytes.
Bytes EncodeHistory(std::uint64_t map_key, const HistoryPart& history);
HistoryPart DecodeHistory(std::uint64_t map_key, std::span<const std::uint8_t> bytes);

// Empty if the map has none, as in an older format.
std::optional<HistoryPart> ReadHistory(const Database& database, std::uint64_t key);
void WriteHistory(const Database& database, std::uint64_t key, const HistoryPart& history);
void RemoveHistory(const Database& database, std::uint64_t key);

}  // namespace docent::maps
