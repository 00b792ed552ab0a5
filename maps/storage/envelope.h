// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "maps/storage/byte_stream.h"

// The envelope around every binary column: its type, its map, its number of records and its checksum.
//
//   offset  size  field
//        0     4  magic, ASCII
//        4     4  version of the layout, 1
//        8     8  key of the map it belongs to
//       16     8  count of records
//       24     n  records
//     24+n     8  XXH64 (seed 0) of everything before
namespace docent::maps {

inline constexpr std::uint32_t kLayoutVersion = 1;
inline constexpr std::size_t kEnvelopeBytes = 32;

struct EnvelopeKind {
  std::array<char, 4> magic;
  const char* name;          // For messages, for instance "the table of points".
  std::size_t record_bytes;  // 0 when records vary in length.
};

inline constexpr EnvelopeKind kCameraTableKind = {{'D', 'C', 'A', 'M'}, "the table of cameras", 0};
inline constexpr EnvelopeKind kKeyFrameTableKind = {{'D', 'K', 'F', 'R'}, "the table of keyframes", 98};
inline constexpr EnvelopeKind kPointTableKind = {{'D', 'P', 'N', 'T'}, "the table of points", 61};
inline constexpr EnvelopeKind kObservationTableKind = {{'D', 'O', 'B', 'S'}, "the table of observations", 17};
inline constexpr EnvelopeKind kSceneKind = {{'D', 'S', 'C', 'N'}, "the scene", 0};
inline constexpr EnvelopeKind kHistoryKind = {{'D', 'H', 'S', 'T'}, "the undo history", 0};
inline constexpr EnvelopeKind kBlockCheckKind = {{'D', 'B', 'L', 'K'}, "the table of block checksums", 8};
inline constexpr EnvelopeKind kPanoramaTableKind = {{'D', 'P', 'A', 'N'}, "the table of panorama maps", 0};
inline constexpr EnvelopeKind kThumbnailTableKind = {{'D', 'T', 'H', 'M'}, "the table of thumbnails", 0};
inline constexpr EnvelopeKind kWordTableKind = {{'D', 'W', 'R', 'D'}, "the table of words", 0};
inline constexpr EnvelopeKind kMeshKind = {{'D', 'M', 'S', 'H'}, "the mesh", 0};
inline constexpr EnvelopeKind kImageKind = {{'D', 'P', 'I', 'C'}, "the image", 0};

// Writes the header; the caller appends `count` records.
ByteWriter BeginEnvelope(const EnvelopeKind& kind, std::uint64_t map_key, std::uint64_t count);
Bytes FinishEnvelope(ByteWriter writer);

struct Envelope {
  ByteReader records;
  std::uint64_t count = 0;  // For records of fixed length, checked against the number of bytes.
};
// Throws docent::Error with a message about `kind` when the bytes are not a valid envelope of that map.
Envelope OpenEnvelope(const EnvelopeKind& kind, std::uint64_t map_key, std::span<const std::uint8_t> bytes);

}  // namespace docent::maps
