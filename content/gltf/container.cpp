// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/container.h"

#include <array>
#include <cstring>

#include "content/gltf/json.h"

namespace docent::content {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

// GLB numbers are little-endian on every machine.
std::uint32_t ReadU32(std::span<const std::uint8_t> bytes, std::size_t offset) {
  return std::uint32_t{bytes[offset]} | std::uint32_t{bytes[offset + 1]} << 8 |
         std::uint32_t{bytes[offset + 2]} << 16 | std::uint32_t{bytes[offset + 3]} << 24;
}

void AppendU32(std::uint32_t value, std::vector<std::uint8_t>* bytes) {
  for (int shift = 0; shift < 32; shift += 8) bytes->push_back(static_cast<std::uint8_t>(value >> shift));
}

void AppendChunk(std::uint32_t type, std::span<const std::uint8_t> data, std::uint8_t padding,
                 std::vector<std::uint8_t>* glb) {
  const std::size_t padded = (data.size() + 3) / 4 * 4;
  AppendU32(static_cast<std::uint32_t>(padded), glb);
  AppendU32(type, glb);
  glb->insert(glb->end(), data.begin(), data.end());
  glb->insert(glb->end(), padded - data.size(), padding);
}

// The bytes that the header covers; further bytes are ignored.
std::span<const std::uint8_t> WithoutTail(std::string_view file, std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kHeaderBytes) Refuse(file, "", "the GLB file is cut off inside its header.");
  const std::uint32_t version = ReadU32(bytes, 4), length = ReadU32(bytes, 8);
  if (version == 1) Refuse(file, "", "this is a glTF 1.0 file; convert it to glTF 2.0 first.");
  if (version != 2) Refuse(file, "", "the GLB header says version " + std::to_string(version) + ", not 2.");
  if (length > bytes.size()) {
    Refuse(file, "",
           "the GLB file is cut off: its header gives " + std::to_string(length) + " bytes and there are " +
               std::to_string(bytes.size()) + ".");
  }
  return bytes.first(length);
}

// Returns the data of the chunk at `offset` and moves `offset` past it.
std::span<const std::uint8_t> TakeChunk(std::string_view file, std::span<const std::uint8_t> bytes,
                                        std::size_t* offset, std::uint32_t* type) {
  if (bytes.size() - *offset < kChunkHeaderBytes)
    Refuse(file, "", "the GLB file is cut off inside a chunk header.");
  const std::uint32_t length = ReadU32(bytes, *offset);
  *type = ReadU32(bytes, *offset + 4);
  *offset += kChunkHeaderBytes;
  if (length > bytes.size() - *offset) Refuse(file, "", "a GLB chunk is longer than the file.");
  if (length % 4 != 0) Refuse(file, "", "the length of a GLB chunk is not a multiple of 4.");
  const std::span<const std::uint8_t> data = bytes.subspan(*offset, length);
  *offset += length;
  return data;
}

GltfContainer SplitGlb(std::string_view file, std::span<const std::uint8_t> bytes) {
  bytes = WithoutTail(file, bytes);
  GltfContainer container;
  container.is_glb = true;
  std::size_t offset = kHeaderBytes;
  for (int number = 0; offset < bytes.size(); ++number) {
    std::uint32_t type = 0;
    const std::span<const std::uint8_t> data = TakeChunk(file, bytes, &offset, &type);
    if ((number == 0) != (type == kJsonChunk)) {
      Refuse(file, "",
             number == 0 ? "the first GLB chunk is not JSON." : "the GLB file has two JSON chunks.");
    }
    if (type == kJsonChunk) {
      if (data.empty()) Refuse(file, "", "the JSON chunk of the GLB file is empty.");
      container.json = {reinterpret_cast<const char*>(data.data()), data.size()};
    } else if (type == kBinChunk) {
      if (number != 1) Refuse(file, "", "the BIN chunk is not the second chunk of the GLB file.");
      container.bin = data;
    }
  }
  if (container.json.empty()) Refuse(file, "", "the GLB file has no JSON chunk.");
  return container;
}

}  // namespace

GltfContainer SplitGltf(std::string_view file, std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) Refuse(file, "", "the file is empty.");
  if (bytes.size() >= 4 && ReadU32(bytes, 0) == kMagic) return SplitGlb(file, bytes);
  GltfContainer container;
  container.json = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  // No JSON object can begin with this byte. This message is clearer than the JSON parser's.
  const std::size_t first = container.json.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first == std::string_view::npos || container.json[first] != '{') {
    Refuse(file, "", "this is neither a GLB file nor glTF text.");
  }
  return container;
}

std::vector<std::uint8_t> MakeGlb(std::string_view json, std::span<const std::uint8_t> bin) {
  std::vector<std::uint8_t> glb;
  glb.reserve(kHeaderBytes + 2 * kChunkHeaderBytes + json.size() + bin.size() + 8);
  AppendU32(kMagic, &glb);
  AppendU32(2, &glb);
  AppendU32(0, &glb);
  AppendChunk(kJsonChunk, {reinterpret_cast<const std::uint8_t*>(json.data()), json.size()}, ' ', &glb);
  if (!bin.empty()) AppendChunk(kBinChunk, bin, 0, &glb);
  const auto length = static_cast<std::uint32_t>(glb.size());
  for (int i = 0; i < 4; ++i)
    glb[8 + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(length >> (8 * i));
  return glb;
}

}  // namespace docent::content
