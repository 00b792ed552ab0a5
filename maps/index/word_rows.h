// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/keyframe_words.h"
#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

// The table `words`: one row per map with the visual words of its keyframes and the keyframe that represents
// each place, so that a large library can be opened without its images. Words are only valid for the
// vocabulary that produced them, so a row identifies it. The functions run inside a transaction of the
// caller, validate what they read, and throw docent::Error.
namespace docent::maps {

// By ascending keyframe.
struct WordTable {
  std::uint64_t vocabulary = 0;  // Fingerprint of the vocabulary.
  std::vector<engine::KeyFrameWords> keyframes;

  bool operator==(const WordTable& other) const = default;
};

// The fingerprint of this program's vocabulary.
std::uint64_t VocabularyFingerprint();

Bytes EncodeWords(std::uint64_t map_key, const WordTable& table);
WordTable DecodeWords(std::uint64_t map_key, std::span<const std::uint8_t> bytes);

void WriteWords(const Database& database, std::uint64_t key, std::vector<engine::KeyFrameWords> keyframes);
// Returns one entry for each keyframe that `info` counts, or none if the library's format has no such table
// or another vocabulary was used.
std::vector<engine::KeyFrameWords> ReadWords(const Database& database, const MapInfo& info);
// Returns the stored words of those keyframes whose image has not changed; unreadable words are left out.
std::vector<engine::KeyFrameWords> UnchangedWords(const Database& database, const MapInfo& info,
                                                  const std::vector<StoredKeyFrame>& stored,
                                                  const std::vector<StoredKeyFrame>& wanted);
// Computes the words from the images of a map, regardless of the table.
std::vector<engine::KeyFrameWords> WordsFromImages(const Database& database, const MapInfo& info);

}  // namespace docent::maps
