// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/checksum.h"

#include <xxhash.h>

namespace docent::maps {

std::uint64_t Checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  return XXH64(bytes.data(), bytes.size(), seed);
}

std::uint64_t SceneTextChecksum(const std::string& text) {
  return Checksum({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace docent::maps
