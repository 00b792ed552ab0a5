// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/history_rows.h"

#include <string>
#include <unordered_set>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/envelope.h"
#include "maps/storage/rows.h"

namespace docent::maps {

namespace {

constexpr const char* kHistoryPart = "history";

[[noreturn]] void RefuseHistory(const std::string& what) {
  throw Error("its undo history is damaged: " + what);
}

}  // namespace

Bytes EncodeHistory(std::uint64_t map_key, const HistoryPart& history) {
  if (history.changes.text.size() > kMaxHistoryTextBytes)
    throw Error("its undo history has more than " + std::to_string(kMaxHistoryTextBytes) + " bytes");
  ByteWriter writer = BeginEnvelope(kHistoryKind, map_key, history.changes.asset_ids.size());
  writer.Put(history.scene);
  writer.PutText(history.changes.text);
  for (const std::string& id : history.changes.asset_ids) writer.PutText(id);
  return FinishEnvelope(std::move(writer));
}

HistoryPart DecodeHistory(std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kHistoryKind, map_key, bytes);
  HistoryPart history;
  history.scene = reader.Get<std::uint64_t>();
  history.changes.text = reader.GetText();
  constexpr std::size_t kSmallestId = sizeof(std::uint32_t) + kMinAssetIdBytes;
  if (reader.failed() || history.changes.text.size() > kMaxHistoryTextBytes ||
      count > reader.remaining() / kSmallestId)
    RefuseHistory("its length does not match");
  history.changes.asset_ids.reserve(count);
  std::unordered_set<std::string> seen;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string id = reader.GetText();
    if (id.size() < kMinAssetIdBytes || id.size() > kMaxAssetIdBytes || !seen.insert(id).second)
      RefuseHistory("it refers to an asset without a valid id");
    history.changes.asset_ids.push_back(std::move(id));
  }
  if (reader.failed() || reader.remaining() != 0) RefuseHistory("its length does not match");
  return history;
}

std::optional<HistoryPart> ReadHistory(const Database& database, std::uint64_t key) {
  const std::optional<Bytes> bytes = FindPart(database, key, kHistoryPart);
  if (!bytes) return std::nullopt;
  return DecodeHistory(key, *bytes);
}

void WriteHistory(const Database& database, std::uint64_t key, const HistoryPart& history) {
  WritePart(database, key, kHistoryPart, EncodeHistory(key, history));
}

void RemoveHistory(const Database& database, std::uint64_t key) {
  database.Prepare("DELETE FROM parts WHERE map_key = ? AND part = ?")
      .Bind(1, static_cast<std::int64_t>(key))
      .Bind(2, std::string_view(kHistoryPart))
      .Run();
}

}  // namespace docent::maps
