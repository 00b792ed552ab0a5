// SPDX-License-Identifier: Apache-2.0
#include "maps/index/word_rows.h"

#include <algorithm>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "engine/vision/features.h"
#include "maps/storage/envelope.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"

namespace docent::maps {

namespace {

[[noreturn]] void Damaged(const char* what) {
  throw Error(std::string("the table of words is damaged: ") + what);
}

}  // namespace

std::uint64_t VocabularyFingerprint() {
  static const std::uint64_t fingerprint = engine::DefaultVocabulary().Fingerprint();
  return fingerprint;
}

Bytes EncodeWords(std::uint64_t map_key, const WordTable& table) {
  ByteWriter writer = BeginEnvelope(kWordTableKind, map_key, table.keyframes.size());
  writer.Put(table.vocabulary);
  for (const engine::KeyFrameWords& keyframe : table.keyframes) {
    writer.Put(std::uint32_t{keyframe.keyframe});
    writer.Put(std::uint32_t{keyframe.place});
    writer.Put(static_cast<std::uint16_t>(keyframe.words.size()));
    for (const engine::VisualWord& word : keyframe.words) writer.Put(word.bits());
  }
  return FinishEnvelope(std::move(writer));
}

WordTable DecodeWords(std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kWordTableKind, map_key, bytes);
  constexpr std::size_t kSmallestRecord = 10;
  WordTable table;
  table.vocabulary = reader.Get<std::uint64_t>();
  if (reader.failed() || count > reader.remaining() / kSmallestRecord) Damaged("its length does not match");
  table.keyframes.resize(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    engine::KeyFrameWords& next = table.keyframes[i];
    next.keyframe = reader.Get<std::uint32_t>();
    next.place = reader.Get<std::uint32_t>();
    const std::size_t words = reader.Get<std::uint16_t>();
    ByteReader packed(reader.GetBytes(words * sizeof(std::uint16_t)));
    if (reader.failed()) Damaged("it is cut off");
    if (i > 0 && table.keyframes[i - 1].keyframe >= next.keyframe) Damaged("its keyframes are out of order");
    // The keyframe that represents a place comes first and represents itself.
    const auto leader = std::lower_bound(
        table.keyframes.begin(), table.keyframes.begin() + static_cast<std::ptrdiff_t>(i) + 1, next.place,
        [](const engine::KeyFrameWords& k, engine::KeyFrameId id) { return k.keyframe < id; });
    if (leader - table.keyframes.begin() > static_cast<std::ptrdiff_t>(i) || leader->keyframe != next.place ||
        leader->place != next.place) {
      Damaged("a keyframe has no valid place");
    }
    next.words.reserve(words);
    for (std::size_t w = 0; w < words; ++w) {
      const auto word = engine::VisualWord::FromBits(packed.Get<std::uint16_t>());
      if (w > 0 && next.words.back().leaf() >= word.leaf()) Damaged("its words are out of order");
      next.words.push_back(word);
    }
  }
  if (reader.remaining() != 0) Damaged("its length does not match");
  return table;
}

void WriteWords(const Database& database, std::uint64_t key, std::vector<engine::KeyFrameWords> keyframes) {
  const Bytes bytes = EncodeWords(key, {VocabularyFingerprint(), std::move(keyframes)});
  database.Prepare("INSERT OR REPLACE INTO words (map_key, data) VALUES (?, ?)")
      .Bind(1, static_cast<std::int64_t>(key))
      .Bind(2, std::span<const std::uint8_t>(bytes))
      .Run();
}

std::vector<engine::KeyFrameWords> ReadWords(const Database& database, const MapInfo& info) {
  if (SchemaVersion(database) < kWordsSince) return {};
  Statement query = database.Prepare("SELECT data FROM words WHERE map_key = ?");
  query.Bind(1, static_cast<std::int64_t>(info.key));
  if (!query.Step()) throw Error("its words are missing");
  WordTable table = DecodeWords(info.key, query.Blob(0));
  if (table.keyframes.size() != info.keyframes)
    throw Error("the number of its words' keyframes differs from that of its keyframes");
  if (table.vocabulary != VocabularyFingerprint()) return {};
  return std::move(table.keyframes);
}

std::vector<engine::KeyFrameWords> UnchangedWords(const Database& database, const MapInfo& info,
                                                  const std::vector<StoredKeyFrame>& stored,
                                                  const std::vector<StoredKeyFrame>& wanted) {
  std::vector<engine::KeyFrameWords> words;
  if (stored.empty()) return words;
  try {
    words = ReadWords(database, info);
  } catch (const Error&) {
    return {};
  }
  const auto same_image = [&](engine::KeyFrameId keyframe) {
    const auto find = [&](const std::vector<StoredKeyFrame>& all) {
      const auto found =
          std::lower_bound(all.begin(), all.end(), keyframe,
                           [](const StoredKeyFrame& k, engine::KeyFrameId id) { return k.keyframe.id < id; });
      return found != all.end() && found->keyframe.id == keyframe ? &*found : nullptr;
    };
    const StoredKeyFrame *before = find(stored), *after = find(wanted);
    return before && after && before->image_hash == after->image_hash;
  };
  std::erase_if(words, [&](const engine::KeyFrameWords& of) { return !same_image(of.keyframe); });
  return words;
}

std::vector<engine::KeyFrameWords> WordsFromImages(const Database& database, const MapInfo& info) {
  const MapParts parts = ReadParts(database, info);
  engine::MapSnapshot map;
  for (const StoredKeyFrame& stored : parts.keyframes) map.keyframes.push_back(stored.keyframe);
  const std::vector<engine::KeyFrameId> places = engine::PlacesOf(map);
  std::vector<engine::KeyFrameWords> words(parts.keyframes.size());
  ReadImages(
      database, info.key, parts.keyframes, [&](std::size_t index, std::span<const std::uint8_t> bytes) {
        const auto features = engine::MakeFeatures(DecodeImage(info.key, parts.keyframes[index], bytes));
        words[index] = {parts.keyframes[index].keyframe.id, places[index], engine::MakeWordBag(*features)};
      });
  return words;
}

}  // namespace docent::maps
