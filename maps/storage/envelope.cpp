// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/envelope.h"

#include <algorithm>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/checksum.h"

namespace docent::maps {

ByteWriter BeginEnvelope(const EnvelopeKind& kind, std::uint64_t map_key, std::uint64_t count) {
  ByteWriter writer;
  for (const char character : kind.magic) writer.Put(character);
  writer.Put(kLayoutVersion);
  writer.Put(map_key);
  writer.Put(count);
  return writer;
}

Bytes FinishEnvelope(ByteWriter writer) {
  writer.Put(Checksum(writer.bytes()));
  return writer.Take();
}

Envelope OpenEnvelope(const EnvelopeKind& kind, std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  const std::string name = kind.name;
  if (bytes.size() < kEnvelopeBytes) throw Error(name + " is cut off");
  if (!std::equal(kind.magic.begin(), kind.magic.end(), bytes.begin())) {
    throw Error(name + " is damaged: its header is not valid");
  }
  const auto body = bytes.first(bytes.size() - sizeof(std::uint64_t));
  if (ByteReader(bytes.last(sizeof(std::uint64_t))).Get<std::uint64_t>() != Checksum(body)) {
    throw Error(name + " is damaged: its checksum does not match");
  }
  ByteReader reader(body.subspan(kind.magic.size()));
  if (const auto version = reader.Get<std::uint32_t>(); version != kLayoutVersion) {
    throw Error(name + " has layout version " + std::to_string(version) +
                ", which this program does not know");
  }
  if (reader.Get<std::uint64_t>() != map_key) throw Error(name + " belongs to another map");
  const auto count = reader.Get<std::uint64_t>();
  if (kind.record_bytes > 0 &&
      (reader.remaining() % kind.record_bytes != 0 || count != reader.remaining() / kind.record_bytes)) {
    throw Error(name + " is damaged: its header gives " + std::to_string(count) + " records for " +
                std::to_string(reader.remaining()) + " bytes");
  }
  return {reader, count};
}

}  // namespace docent::maps
