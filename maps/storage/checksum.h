// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace docent::maps {

// The XXH64 hash of the bytes (libxxhash). It detects damage, not forgery. Never throws.
std::uint64_t Checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed = 0);

// The same of the text of a scene. It tells one state of a scene from another.
std::uint64_t SceneTextChecksum(const std::string& text);

}  // namespace docent::maps
