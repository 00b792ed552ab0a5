// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/word_bag.h"
#include "maps/database.h"
#include "maps/map_codec.h"
#include "maps/map_record.h"

// The table `words`: what each keyframe of a map shows as words of the vocabulary tree, and which keyframes
// are one place, in one row a map, so that a large library is opened without its images. Words mean
// something under the vocabulary that made them alone, so a row names it. Inside a transaction that the
// caller holds; what is read is checked; throws docent::Error.
namespace docent::maps {

struct KeyFrameWords {
  engine::KeyFrameId keyframe = engine::kNoId;
  engine::KeyFrameId place = engine::kNoId;  // the keyframe that stands for its place; see PlacesOf
  engine::WordBag words;

  bool operator==(const KeyFrameWords& other) const = default;
};

// By ascending keyframe.
struct WordTable {
  std::uint64_t vocabulary = 0;  // its fingerprint
  std::vector<KeyFrameWords> keyframes;

  bool operator==(const WordTable& other) const = default;
};

// Of the vocabulary that this program has.
std::uint64_t VocabularyFingerprint();

// For each keyframe the one that stands for its place: the first that was taken near it (within half the
// distance of what it sees, turned by at most 35 degrees) and stands for a place itself, or it stands for a
// new one. In the keyframes' order.
std::vector<engine::KeyFrameId> PlacesOf(const engine::MapSnapshot& map);

// The words of a map's keyframes: those that `known` has (may be empty; by ascending keyframe) are taken from
// there, the others are made, some milliseconds each.
std::vector<KeyFrameWords> MakeWords(const engine::MapSnapshot& map, std::span<const KeyFrameWords> known);

// The words of an image; empty where it is too small for any.
engine::WordBag WordsOf(const engine::ImageFeatures& features);

Bytes EncodeWords(std::uint64_t map_key, const WordTable& table);
WordTable DecodeWords(std::uint64_t map_key, std::span<const std::uint8_t> bytes);

void WriteWords(const Database& database, std::uint64_t key, std::vector<KeyFrameWords> keyframes);
// One for each keyframe that `info` counts; none where nothing is known: from a library of a format that had
// no such table, or one that another vocabulary was used for.
std::vector<KeyFrameWords> ReadWords(const Database& database, const MapInfo& info);
// Of those keyframes whose image is still the one that is stored, what is stored; what cannot be read is
// left out.
std::vector<KeyFrameWords> UnchangedWords(const Database& database, const MapInfo& info,
                                          const std::vector<StoredKeyFrame>& stored,
                                          const std::vector<StoredKeyFrame>& wanted);
// From the images of a map, whatever the table says.
std::vector<KeyFrameWords> WordsFromImages(const Database& database, const MapInfo& info);

}  // namespace docent::maps
