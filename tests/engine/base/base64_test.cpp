// SPDX-License-Identifier: Apache-2.0
#include "engine/base/base64.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"

namespace docent {
namespace {

std::vector<std::uint8_t> Bytes(std::string_view text) {
  return {text.begin(), text.end()};
}

// RFC 4648, section 10.
TEST(Base64, EncodesTheExamplesOfTheStandard) {
  EXPECT_EQ(EncodeBase64({}), "");
  EXPECT_EQ(EncodeBase64(Bytes("f")), "Zg==");
  EXPECT_EQ(EncodeBase64(Bytes("fo")), "Zm8=");
  EXPECT_EQ(EncodeBase64(Bytes("foo")), "Zm9v");
  EXPECT_EQ(EncodeBase64(Bytes("foob")), "Zm9vYg==");
}

TEST(Base64, DecodingRevertsEncodingWithAndWithoutPadding) {
  Random random(4);
  for (std::size_t size = 0; size < 200; ++size) {
    std::vector<std::uint8_t> bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.Below(256));
    std::string text = EncodeBase64(bytes);
    EXPECT_EQ(text.size() % 4, 0u);
    EXPECT_EQ(DecodeBase64(text), bytes);
    while (text.ends_with('=')) text.pop_back();
    EXPECT_EQ(DecodeBase64(text), bytes);
  }
}

TEST(Base64, RefusesOtherCharactersAndImpossibleLengths) {
  for (const char* text : {"Z", "Zm9vY", "Zg*=", "Zm 9v", "Zm-_", "=Zm9v"}) {
    EXPECT_EQ(DecodeBase64(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace docent
