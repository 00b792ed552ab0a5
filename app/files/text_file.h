// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/time.h"

// Reads and writes small external files: whole files of bounded size, lines with their numbers, and numbers
// that are validated. Nothing here depends on the locale.
namespace docent::app {

// Returns the whole file. Throws Error when it is missing, a folder, unreadable, or larger than max_bytes.
std::string ReadTextFile(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{64} << 20);
// Replaces the file. Throws Error when the disk does not take all of it.
void WriteTextFile(const std::filesystem::path& path, std::string_view text);
// Reads a binary file, such as an image, into a buffer that is reused.
void ReadBytes(const std::filesystem::path& path, std::size_t max_bytes, std::vector<std::uint8_t>* bytes);

// A line with content: comments (from '#' on) and surrounding blanks are removed, empty lines are skipped.
struct TextLine {
  int number = 0;         // counts from 1
  std::string_view text;  // a view into the text that was split
};
std::vector<TextLine> ContentLines(std::string_view text);

// The fields of a line, separated by any run of the separators.
std::vector<std::string_view> SplitFields(std::string_view line, std::string_view separators = " \t");

std::string_view Trim(std::string_view text);

// Empty unless the whole text is one finite number.
std::optional<double> ParseNumber(std::string_view text);
std::optional<std::int64_t> ParseInteger(std::string_view text);
// Parses a time in decimal seconds, exact to the nanosecond (a double holds 1.4e9 seconds to 0.2 us only).
// Digits beyond the ninth are rounded. Empty unless the whole text is one number of at most 250 years.
std::optional<Timestamp> ParseSeconds(std::string_view text);
// Seconds with nine decimals; ParseSeconds returns the same time.
std::string FormatSeconds(Timestamp time);
// The shortest text with at most `digits` significant digits ("nan" and "inf" for values that are not
// finite).
std::string FormatNumber(double value, int digits = 9);

// The shortest text that ParseNumber reads as the same double: 0.15, where seventeen digits would be
// 0.14999999999999999. ("nan" and "inf" as above.)
std::string FormatExactly(double value);

// True when `a` sorts before `b` in natural order: runs of digits compare as numbers.
bool NaturalLess(std::string_view a, std::string_view b);

}  // namespace docent::app
