// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace docent::maps {

// The XXH64 hash of the bytes (libxxhash). It detects damage, not forgery. Never throws.
std::uint64_t Checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed = 0);

}  // namespace docent::maps
