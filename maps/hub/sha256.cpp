// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/sha256.h"

#include <nettle/sha2.h>

#include <algorithm>
#include <array>

namespace docent::maps {

std::string HashOf(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, bytes.size(), bytes.data());
  std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
  sha256_digest(&context, digest.size(), digest.data());
  std::string text;
  for (const std::uint8_t byte : digest) text += {kDigits[byte >> 4], kDigits[byte & 15]};
  return text;
}

std::string HashOf(std::string_view text) {
  return HashOf(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

bool IsHash(std::string_view text) {
  return text.size() == 2 * SHA256_DIGEST_SIZE && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

}  // namespace docent::maps
