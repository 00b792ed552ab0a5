// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/block_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "maps/storage/map_codec.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

TEST(BlockChecks, ConfirmExactlyTheRecordsWhoseBlocksAreIntact) {
  constexpr std::uint64_t kKey = 7;
  const auto map = MakeSampleMap(1, {.keyframes = 3, .points = 2000});
  const Bytes column = EncodePoints(kKey, map->points), checks = EncodeBlockChecks(kKey, column);
  EXPECT_EQ(ConfirmedRecords(kPointTableKind, kKey, column, checks), column);
  Random random(3);
  for (int round = 0; round < 50; ++round) {
    Bytes damaged = column;
    std::vector<bool> intact(column.size() / kCheckedBlockBytes + 1, true);
    for (int i = 0; i < 4; ++i) {
      const std::size_t at = random.Below(static_cast<std::uint32_t>(column.size()));
      damaged[at] ^= static_cast<std::uint8_t>(1 + random.Below(255));
      intact[at / kCheckedBlockBytes] = false;
    }
    // Two changes of one byte can cancel out.
    for (std::size_t i = 0; i < intact.size(); ++i) {
      const std::size_t begin = i * kCheckedBlockBytes,
                        end = std::min(begin + kCheckedBlockBytes, column.size());
      if (std::equal(column.begin() + static_cast<std::ptrdiff_t>(begin),
                     column.begin() + static_cast<std::ptrdiff_t>(end),
                     damaged.begin() + static_cast<std::ptrdiff_t>(begin)))
        intact[i] = true;
    }
    std::vector<engine::MapPointId> expected, found;
    for (std::size_t i = 0; i < map->points.size(); ++i) {
      const std::size_t begin = 24 + 61 * i, last = begin + 60;  // The layout of the column.
      if (intact[begin / kCheckedBlockBytes] && intact[last / kCheckedBlockBytes])
        expected.push_back(map->points[i].id);
    }
    const Bytes confirmed = ConfirmedRecords(kPointTableKind, kKey, damaged, checks);
    for (const engine::MapPoint& point : DecodePoints(kKey, confirmed)) found.push_back(point.id);
    EXPECT_EQ(found, expected);
    EXPECT_LT(found.size(), map->points.size());
  }
}

TEST(BlockChecks, OfAnotherColumnOrDamagedAreRefused) {
  const auto map = MakeSampleMap(1, {.keyframes = 3, .points = 500});
  const Bytes column = EncodePoints(7, map->points), checks = EncodeBlockChecks(7, column);
  EXPECT_NE(ErrorOf([&] { ConfirmedRecords(kPointTableKind, 8, column, checks); }), "");
  Bytes damaged = checks;
  damaged[30] ^= 1;
  EXPECT_NE(ErrorOf([&] { ConfirmedRecords(kPointTableKind, 7, column, damaged); }), "");
  const Bytes shorter(column.begin(), column.begin() + 5000);
  EXPECT_NE(ErrorOf([&] { ConfirmedRecords(kPointTableKind, 7, shorter, checks); }), "");
  EXPECT_NE(ErrorOf([&] { ConfirmedRecords(kPointTableKind, 7, {}, EncodeBlockChecks(7, {})); }), "");
  // Blocks that no checksum confirms hold no record.
  const Bytes other(column.size(), 1);
  EXPECT_TRUE(DecodePoints(7, ConfirmedRecords(kPointTableKind, 7, other, checks)).empty());
}

}  // namespace
}  // namespace docent::maps
