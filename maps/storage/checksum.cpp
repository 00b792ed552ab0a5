// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/checksum.h"

#include <xxhash.h>

namespace docent::maps {

std::uint64_t Checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  return XXH64(bytes.data(), bytes.size(), seed);
}

}  // namespace docent::maps
