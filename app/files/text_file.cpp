// SPDX-License-Identifier: Apache-2.0
#include "app/files/text_file.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <system_error>

#include "app/files/checked_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

template <typename Buffer>
void ReadInto(const std::filesystem::path& path, std::size_t max_bytes, Buffer* buffer) {
  buffer->clear();
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  // As below a folder without permission: whether there is a file is not known.
  if (error && status.type() == std::filesystem::file_type::none)
    throw Error("Cannot read '" + path.string() + "': " + error.message() + ".");
  if (!std::filesystem::exists(status)) throw Error("There is no file '" + path.string() + "'.");
  if (std::filesystem::is_directory(status)) {
    throw Error("'" + path.string() + "' is a folder, not a file.");
  }
  if (!std::filesystem::is_regular_file(status))
    throw Error("'" + path.string() + "' is not a regular file.");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw Error("Cannot read '" + path.string() + "': " + error.message() + ".");
  if (size > max_bytes) {
    throw Error("'" + path.string() + "' has " + std::to_string(size) + " bytes; at most " +
                std::to_string(max_bytes) + " are allowed.");
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file)
    throw Error("Cannot open '" + path.string() + "': " + std::generic_category().message(errno) + ".");
  buffer->resize(static_cast<std::size_t>(size));
  const std::size_t read = size == 0 ? 0 : std::fread(buffer->data(), 1, buffer->size(), file.get());
  if (read != buffer->size()) throw Error("Cannot read '" + path.string() + "' completely.");
}

}  // namespace

std::string ReadTextFile(const std::filesystem::path& path, std::size_t max_bytes) {
  std::string text;
  ReadInto(path, max_bytes, &text);
  return text;
}

void WriteTextFile(const std::filesystem::path& path, std::string_view text) {
  CheckedFile file(path);
  file.Write(text);
  file.Close();
}

void ReadBytes(const std::filesystem::path& path, std::size_t max_bytes, std::vector<std::uint8_t>* bytes) {
  ReadInto(path, max_bytes, bytes);
}

std::string_view Trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n\f\v";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<TextLine> ContentLines(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // the byte-order mark that some editors write
  std::vector<TextLine> lines;
  int number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    line = Trim(line.substr(0, line.find('#')));
    if (!line.empty()) lines.push_back({number, line});
  }
  return lines;
}

std::vector<std::string_view> SplitFields(std::string_view line, std::string_view separators) {
  std::vector<std::string_view> fields;
  std::size_t begin = line.find_first_not_of(separators);
  while (begin != std::string_view::npos) {
    const std::size_t end = line.find_first_of(separators, begin);
    fields.push_back(line.substr(begin, end == std::string_view::npos ? end : end - begin));
    begin = end == std::string_view::npos ? end : line.find_first_not_of(separators, end);
  }
  return fields;
}

std::optional<double> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) {  // from_chars does not accept a plus sign
    text.remove_prefix(1);
    if (text.empty() || !(IsDigit(text[0]) || text[0] == '.')) return std::nullopt;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> ParseInteger(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<Timestamp> ParseSeconds(std::string_view text) {
  constexpr double kMaxSeconds = 8e9;  // about 250 years; nanoseconds in 64 bits hold 292
  const std::optional<double> rounded = ParseNumber(text);
  if (!rounded || std::abs(*rounded) > kMaxSeconds) return std::nullopt;
  if (text.find_first_of("eE") != std::string_view::npos) return FromSeconds(*rounded);

  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  std::int64_t nanoseconds = 0;
  std::size_t i = 0;
  for (; i < text.size() && IsDigit(text[i]); ++i) nanoseconds = nanoseconds * 10 + (text[i] - '0');
  if (i < text.size()) ++i;  // the decimal point
  for (int digit = 0; digit < 9; ++digit) {
    nanoseconds *= 10;
    if (i < text.size()) nanoseconds += text[i++] - '0';
  }
  if (i < text.size() && text[i] >= '5') ++nanoseconds;
  return Timestamp(negative ? -nanoseconds : nanoseconds);
}

std::string FormatSeconds(Timestamp time) {
  const std::int64_t count = time.count();
  const std::uint64_t magnitude =
      count < 0 ? 0 - static_cast<std::uint64_t>(count) : static_cast<std::uint64_t>(count);
  char text[40];
  std::snprintf(text, sizeof text, "%s%llu.%09llu", count < 0 ? "-" : "",
                static_cast<unsigned long long>(magnitude / 1'000'000'000),
                static_cast<unsigned long long>(magnitude % 1'000'000'000));
  return text;
}

std::string FormatNumber(double value, int digits) {
  char text[64];
  if (value == 0) value = 0;  // avoids "-0"
  const auto [end, error] =
      std::to_chars(text, text + sizeof text, value, std::chars_format::general, std::clamp(digits, 1, 17));
  return error == std::errc{} ? std::string(text, end) : std::string("nan");
}

std::string FormatExactly(double value) {
  char text[32];              // at most 24 characters: sign, seventeen digits, point and exponent
  if (value == 0) value = 0;  // avoids "-0"
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return error == std::errc{} ? std::string(text, end) : std::string("nan");
}

bool NaturalLess(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!IsDigit(a[i]) || !IsDigit(b[j])) {
      if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      ++i, ++j;
      continue;
    }
    const auto number = [](std::string_view text, std::size_t* at) {
      while (*at < text.size() && text[*at] == '0') ++*at;
      const std::size_t begin = *at;
      while (*at < text.size() && IsDigit(text[*at])) ++*at;
      return text.substr(begin, *at - begin);
    };
    const std::string_view x = number(a, &i), y = number(b, &j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if ((i < a.size()) != (j < b.size())) return i >= a.size();
  return a < b;  // equal except for leading zeros: any fixed order will do
}

}  // namespace docent::app
