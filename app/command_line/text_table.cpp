// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/text_table.h"

#include <glib.h>

#include <algorithm>

namespace docent::app {

namespace {

std::size_t CellsOf(gunichar character) {
  if (g_unichar_iszerowidth(character) || g_unichar_iscntrl(character)) return 0;
  return g_unichar_iswide(character) ? 2 : 1;
}

std::string Aligned(std::size_t width, Alignment alignment, const std::string& text) {
  if (alignment == Alignment::kLeft) return PaddedTo(width, text);
  return std::string(width - std::min(width, DisplayWidth(text)), ' ') + text;
}

}  // namespace

std::size_t DisplayWidth(std::string_view text) {
  std::size_t width = 0;
  while (!text.empty()) {
    const gunichar character = g_utf8_get_char_validated(text.data(), static_cast<gssize>(text.size()));
    const bool valid = character < static_cast<gunichar>(-2);  // -1: not UTF-8; -2: incomplete
    width += valid ? CellsOf(character) : 1;
    text.remove_prefix(valid ? static_cast<std::size_t>(g_utf8_next_char(text.data()) - text.data())
                             : std::size_t{1});
  }
  return width;
}

std::string PaddedTo(std::size_t width, std::string_view text) {
  std::string padded(text);
  padded.append(width - std::min(width, DisplayWidth(text)), ' ');
  return padded;
}

std::string FormatColumns(const std::vector<TableColumn>& columns,
                          const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const TableColumn& column : columns) widths.push_back(column.min_width);
  for (const std::vector<std::string>& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths.at(i) = std::max(widths.at(i), DisplayWidth(row[i]));
  }
  std::string text;
  for (const std::vector<std::string>& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i)
      line += (i == 0 ? "" : "  ") + Aligned(widths[i], columns[i].alignment, row[i]);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

}  // namespace docent::app
