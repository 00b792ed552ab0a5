// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "content/asset.h"
#include "content/sha256.h"
#include "tests/content/make_gltf.h"

namespace docent::content {
namespace {

std::string HashOf(const std::string& text) {
  return Sha256Hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(Sha256, MatchesTheExamplesOfTheStandard) {
  // The examples of FIPS 180-4 (NIST, "Examples with intermediate values"), and the empty message.
  EXPECT_EQ(HashOf(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(HashOf("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(HashOf("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(HashOf(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PadsEveryLengthAroundABlockDifferently) {
  std::string previous;
  for (std::size_t length = 50; length < 140; ++length) {
    const std::string hash = HashOf(std::string(length, 'x'));
    EXPECT_EQ(hash.size(), 64u);
    EXPECT_NE(hash, previous) << length;
    previous = hash;
  }
}

TEST(Asset, AGlbIsKeptExactlyAndIdentifiedByItsHash) {
  const std::vector<std::uint8_t> glb = TriangleFile().Glb();
  const Asset asset = AssetFromBytes("triangle.glb", glb);
  EXPECT_EQ(asset.bytes, glb);
  EXPECT_EQ(asset.id, Sha256Hex(glb));
  EXPECT_EQ(asset.name, "triangle.glb");
  ASSERT_NE(asset.model, nullptr);
  EXPECT_EQ(asset.model->meshes.size(), 1u);
}

}  // namespace
}  // namespace docent::content
