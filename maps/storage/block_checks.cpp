// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/block_checks.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "maps/storage/checksum.h"

namespace docent::maps {

namespace {

// Before the records of an envelope.
constexpr std::size_t kEnvelopeHeadBytes = kEnvelopeBytes - sizeof(std::uint64_t);

std::size_t BlocksOf(std::size_t bytes) {
  return (bytes + kCheckedBlockBytes - 1) / kCheckedBlockBytes;
}

std::span<const std::uint8_t> Block(std::span<const std::uint8_t> column, std::size_t index) {
  const std::size_t begin = index * kCheckedBlockBytes;
  return column.subspan(begin, std::min(kCheckedBlockBytes, column.size() - begin));
}

}  // namespace

std::string BlockChecksOf(std::string_view part) {
  return std::string(part) + ".blocks";
}

Bytes EncodeBlockChecks(std::uint64_t map_key, std::span<const std::uint8_t> column) {
  const std::size_t count = BlocksOf(column.size());
  ByteWriter writer = BeginEnvelope(kBlockCheckKind, map_key, count);
  for (std::size_t i = 0; i < count; ++i) writer.Put(Checksum(Block(column, i)));
  return FinishEnvelope(std::move(writer));
}

Bytes ConfirmedRecords(const EnvelopeKind& kind, std::uint64_t map_key, std::span<const std::uint8_t> column,
                       std::span<const std::uint8_t> checks) {
  auto [reader, count] = OpenEnvelope(kBlockCheckKind, map_key, checks);
  if (count != BlocksOf(column.size()) || column.size() < kEnvelopeBytes)
    throw Error(std::string(kBlockCheckKind.name) + " belongs to another column");
  std::vector<bool> intact(count);
  for (std::size_t i = 0; i < count; ++i)
    intact[i] = reader.Get<std::uint64_t>() == Checksum(Block(column, i));
  Bytes records;
  const std::size_t all = (column.size() - kEnvelopeBytes) / kind.record_bytes;
  for (std::size_t i = 0; i < all; ++i) {
    const std::size_t begin = kEnvelopeHeadBytes + i * kind.record_bytes,
                      last = begin + kind.record_bytes - 1;
    bool confirmed = true;
    for (std::size_t block = begin / kCheckedBlockBytes; block <= last / kCheckedBlockBytes; ++block)
      confirmed = confirmed && intact[block];
    if (!confirmed) continue;
    const auto record = column.subspan(begin, kind.record_bytes);
    records.insert(records.end(), record.begin(), record.end());
  }
  ByteWriter writer = BeginEnvelope(kind, map_key, records.size() / kind.record_bytes);
  writer.PutBytes(records);
  return FinishEnvelope(std::move(writer));
}

}  // namespace docent::maps
