// SPDX-License-Identifier: Apache-2.0
#include "app/files/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "engine/base/random.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

TEST(Seconds, AreExactToTheNanosecond) {
  EXPECT_EQ(ParseSeconds("1403715273.262142976"), Timestamp(1403715273262142976));
  EXPECT_EQ(ParseSeconds("-0.000000001"), Timestamp(-1));
  EXPECT_EQ(ParseSeconds("7"), Timestamp(7'000'000'000));
  EXPECT_EQ(ParseSeconds(".5"), Timestamp(500'000'000));
  EXPECT_EQ(ParseSeconds("0.0000000005"), Timestamp(1));
  EXPECT_EQ(ParseSeconds("1e-3"), Timestamp(1'000'000));
  EXPECT_EQ(ParseSeconds("+.5"), Timestamp(500'000'000));
}

TEST(Seconds, AreRefusedWhenNotANumber) {
  for (const char* text :
       {"", "-", ".", "1.2.3", "1,5", "nan", "inf", "1e300", "12s", " 1", "+-5", "++5", "+", "+nan"}) {
    EXPECT_FALSE(ParseSeconds(text)) << text;
  }
}

TEST(Seconds, AreReadBackEqual) {
  for (const std::int64_t count : {0LL, 1LL, -1LL, 999'999'999LL, 1403715273262142976LL, -1'500'000'000LL}) {
    EXPECT_EQ(ParseSeconds(FormatSeconds(Timestamp(count))), Timestamp(count))
        << FormatSeconds(Timestamp(count));
  }
}

TEST(TextFile, IsNotCalledMissingWhereThatIsUnknown) {
  const TemporaryFolder folder;
  EXPECT_EQ(ErrorOf([&] { ReadTextFile(folder / "none.txt"); }),
            "There is no file '" + (folder / "none.txt").string() + "'.");
  // A link to itself cannot be followed, whoever reads it; a folder without permission is none for root.
  std::filesystem::create_symlink("loop.txt", folder / "loop.txt");
  EXPECT_THAT(ErrorOf([&] { ReadTextFile(folder / "loop.txt"); }),
              testing::StartsWith("Cannot read '" + (folder / "loop.txt").string() + "': "));
}

TEST(ContentLines, KeepTheirNumbersWithoutCommentsAndBlanks) {
  const auto lines = ContentLines("\xEF\xBB\xBF# head\r\n\r\n  a b # tail\r\nlast");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].number, 3);
  EXPECT_EQ(lines[0].text, "a b");
  EXPECT_EQ(lines[1].number, 4);
  EXPECT_EQ(lines[1].text, "last");
}

TEST(NaturalOrder, ComparesRunsOfDigitsAsNumbers) {
  EXPECT_TRUE(NaturalLess("frame2.png", "frame10.png"));
  EXPECT_FALSE(NaturalLess("frame10.png", "frame2.png"));
  EXPECT_TRUE(NaturalLess("a9b1", "a9b2"));
  EXPECT_TRUE(NaturalLess("a", "a1"));
  EXPECT_FALSE(NaturalLess("a1", "a1"));
  EXPECT_NE(NaturalLess("a01", "a1"), NaturalLess("a1", "a01"));
}

TEST(Numbers, AreWrittenWithoutTheLocaleAndReadBack) {
  EXPECT_EQ(FormatNumber(0.1), "0.1");
  EXPECT_EQ(FormatNumber(-0.0), "0");
  EXPECT_EQ(ParseNumber(FormatNumber(1.0 / 3, 17)), 1.0 / 3);
  EXPECT_FALSE(ParseNumber("nan"));
  EXPECT_FALSE(ParseNumber("1e999"));
  EXPECT_EQ(ParseNumber("+5"), 5);
  EXPECT_FALSE(ParseNumber("+-5"));
}

// The largest and smallest numbers, one that seventeen digits do not show as it was written, and random ones
// of all magnitudes.
TEST(Numbers, AreWrittenExactlyAsTheyWereRead) {
  for (const char* text : {"0.15", "-2.7", "1e+300", "5e-324", "123456.789", "0", "1", "0.1"})
    EXPECT_EQ(FormatExactly(*ParseNumber(text)), text);
  EXPECT_EQ(FormatExactly(-0.0), "0");
  Random random(1);
  for (int i = 0; i < 10'000; ++i) {
    const double value = random.Uniform(-1, 1) * std::pow(10, random.Uniform(-300, 300));
    ASSERT_EQ(ParseNumber(FormatExactly(value)), value);
  }
}

}  // namespace
}  // namespace docent::app
