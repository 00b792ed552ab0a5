// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

// Tables for a terminal, whose columns are aligned by what a character occupies on the screen, not by its
// bytes.
namespace docent::app {

// The number of terminal cells that UTF-8 text occupies: none for combining marks and control characters, two
// for wide East Asian characters and emoji (Unicode Standard Annex 11), else one. A byte that is not UTF-8
// counts as one.
std::size_t DisplayWidth(std::string_view text);

// The text, followed by spaces up to `width` cells; wider text is unchanged.
std::string PaddedTo(std::size_t width, std::string_view text);

enum class Alignment { kLeft, kRight };

struct TableColumn {
  std::size_t min_width = 0;  // cells
  Alignment alignment = Alignment::kLeft;
};

// The rows as lines, each ending with a line break. Columns are as wide as their widest cell, or as
// `min_width`, and two spaces apart; the last one of a row is not padded. Rows have as many cells as there
// are columns.
std::string FormatColumns(const std::vector<TableColumn>& columns,
                          const std::vector<std::vector<std::string>>& rows);

}  // namespace docent::app
