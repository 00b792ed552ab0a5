// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/map_facts.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <string_view>

#include "engine/base/error.h"
#include "maps/hub/sha256.h"
#include "maps/storage/checksum.h"
#include "maps/storage/envelope.h"
#include "maps/storage/map_codec.h"

namespace docent::maps {

namespace {

constexpr std::array<std::string_view, 5> kStructureParts = {"cameras", "keyframes", "points", "observations",
                                                             "panoramas"};
constexpr std::array<std::string_view, 3> kComputedParts = {"thumbnails", "words", "mesh"};
constexpr std::string_view kImage = "image/", kAsset = "asset/";
constexpr std::size_t kMaxDigits = 10;  // Of a keyframe's id, 32 bits.

bool IsImageItem(std::string_view item) {
  if (!item.starts_with(kImage)) return false;
  const std::string_view id = item.substr(kImage.size());
  return !id.empty() && id.size() <= kMaxDigits && (id.size() == 1 || id[0] != '0') &&
         std::all_of(id.begin(), id.end(), [](char c) { return c >= '0' && c <= '9'; });
}

constexpr std::size_t kKeyOffset = 8, kChecksumBytes = 8;  // See envelope.h.

}  // namespace

bool IsStructureItem(const std::string& item) {
  return IsImageItem(item) ||
         std::find(kStructureParts.begin(), kStructureParts.end(), item) != kStructureParts.end();
}

bool IsContentItem(const std::string& item) {
  if (item == "scene") return true;
  if (!item.starts_with(kAsset)) return false;
  const std::string_view id = std::string_view(item).substr(kAsset.size());
  return id.size() >= kMinAssetIdBytes && id.size() <= kMaxAssetIdBytes &&
         std::all_of(id.begin(), id.end(), [](char c) { return c > 0x20 && c < 0x7F; });
}

bool IsItem(const std::string& item) {
  return IsStructureItem(item) || IsContentItem(item) ||
         std::find(kComputedParts.begin(), kComputedParts.end(), item) != kComputedParts.end();
}

std::string StructureDigest(const MapFacts& facts, const Manifest& manifest) {
  std::string text = std::to_string(facts.info.next_keyframe) + " " + std::to_string(facts.info.next_point);
  for (const auto& [item, hash] : manifest) {
    if (IsStructureItem(item)) text += "\n" + item + " " + hash;
  }
  return HashOf(text);
}

std::string NewMapId() {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::random_device random;
  std::string id;
  for (int digit = 0; digit < 32; ++digit) {
    if (digit == 8 || digit == 12 || digit == 16 || digit == 20) id += '-';
    std::uint32_t value = random() & 15;
    if (digit == 12) value = 4;                // The version of a random UUID (RFC 4122).
    if (digit == 16) value = 8 | (value & 3);  // Its variant.
    id += kDigits[value];
  }
  return id;
}

bool IsMapId(const std::string& text) {
  if (text.size() != 36) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const char c = text[i];
    if (dash ? c != '-' : !((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) return false;
  }
  return NumberOf(text) != 0;
}

std::uint64_t NumberOf(const std::string& map_id) {
  std::string digits;
  for (const char c : map_id) {
    if (c != '-' && digits.size() < 16) digits += c;
  }
  return std::stoull(digits, nullptr, 16) & 0x7FFFFFFFFFFFFFFF;
}

Bytes WithKey(const Bytes& column, std::uint64_t key) {
  if (column.size() < kEnvelopeBytes) throw Error("a column of the map is cut off");
  const std::size_t end = column.size() - kChecksumBytes;
  std::uint64_t stored = 0;
  std::memcpy(&stored, column.data() + end, sizeof stored);
  if (stored != Checksum(std::span(column).first(end)))
    throw Error("a column of the map is damaged: its checksum does not match");
  Bytes other = column;
  std::memcpy(other.data() + kKeyOffset, &key, sizeof key);
  const std::uint64_t checksum = Checksum(std::span(other).first(end));
  std::memcpy(other.data() + end, &checksum, sizeof checksum);
  return other;
}

Bytes FromHub(const Bytes& column, std::uint64_t key) {
  Bytes own = WithKey(column, key);
  std::uint64_t stored = 0;
  std::memcpy(&stored, column.data() + kKeyOffset, sizeof stored);
  if (stored != kHubKey) throw Error("a column of the map has another key than those of a hub");
  return own;
}

}  // namespace docent::maps
