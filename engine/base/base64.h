// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// Base64 with the alphabet of RFC 4648, section 4, as in data URIs. Pure functions.
namespace docent {

std::string EncodeBase64(std::span<const std::uint8_t> bytes);
// Padding may be missing. Empty if a character is not of the alphabet, or the length is impossible.
std::optional<std::vector<std::uint8_t>> DecodeBase64(std::string_view text);

}  // namespace docent
