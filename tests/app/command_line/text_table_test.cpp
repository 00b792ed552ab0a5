// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/text_table.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

TEST(DisplayWidth, CountsTheCellsOfATerminal) {
  EXPECT_EQ(DisplayWidth(""), 0u);
  EXPECT_EQ(DisplayWidth("Desk 3"), 6u);
  EXPECT_EQ(DisplayWidth("Küche"), 5u);
  EXPECT_EQ(DisplayWidth("Ku\u0308che"), 5u) << "u with a combining diaeresis";
  EXPECT_EQ(DisplayWidth("東京"), 4u);
  EXPECT_EQ(DisplayWidth("🦊"), 2u);
  EXPECT_EQ(DisplayWidth("\xff"
                         "a\xc3"),
            3u)
      << "bytes that are not UTF-8";
}

TEST(DisplayWidth, IsReachedByPadding) {
  for (const char* text : {"", "Küche", "東京", "🦊 fox"})
    EXPECT_EQ(DisplayWidth(PaddedTo(9, text)), 9u) << text;
  EXPECT_EQ(PaddedTo(2, "Küche"), "Küche");
}

TEST(TextTable, AlignsColumnsWhateverTheNames) {
  const std::string table = FormatColumns(
      {{6}, {0, Alignment::kRight}, {}}, {{"Küche", "7", "a"}, {"東京の部屋", "3075", "b"}, {"x", "12", ""}});
  EXPECT_EQ(table,
            "Küche          7  a\n"
            "東京の部屋  3075  b\n"
            "x             12\n");
}

TEST(TextTable, KeepsTheMinimumWidth) {
  EXPECT_EQ(FormatColumns({{6}, {}}, {{"ab", "c"}}), "ab      c\n");
  EXPECT_EQ(FormatColumns({{6}}, {}), "");
}

}  // namespace
}  // namespace docent::app
