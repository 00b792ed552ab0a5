// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace docent::maps {

// The SHA-256 of the bytes in lower-case hex (nettle), under which a hub stores them. Pure; thread-safe.
std::string HashOf(std::span<const std::uint8_t> bytes);
// The same of a text's bytes.
std::string HashOf(std::string_view text);
// Whether a text is such a hash.
bool IsHash(std::string_view text);

}  // namespace docent::maps
