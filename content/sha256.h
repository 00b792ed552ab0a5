// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace docent::content {

// SHA-256 (FIPS 180-4, §6.2), which identifies an asset by its bytes.
std::array<std::uint8_t, 32> Sha256(std::span<const std::uint8_t> bytes);

// The hash as 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::span<const std::uint8_t> bytes);

}  // namespace docent::content
