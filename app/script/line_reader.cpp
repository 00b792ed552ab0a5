// SPDX-License-Identifier: Apache-2.0
#include "app/script/line_reader.h"

#include <algorithm>
#include <utility>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

const std::string& LineReader::Take(const char* what) {
  if (AtEnd()) Fail(std::string("expected ") + what + " at the end of the line");
  return words_[next_++].text;
}

bool LineReader::TakeIf(std::string_view keyword) {
  if (AtEnd() || words_[next_].quoted || words_[next_].text != keyword) return false;
  ++next_;
  return true;
}

void LineReader::Expect(std::string_view keyword) {
  if (TakeIf(keyword)) return;
  Fail("expected '" + std::string(keyword) + "'" +
       (AtEnd() ? " at the end of the line" : " instead of '" + words_[next_].text + "'"));
}

std::string LineReader::TakeName(const char* what) {
  const std::string& name = Take(what);
  if (name.empty()) Fail(std::string("expected ") + what + " that is not empty");
  return name;
}

double LineReader::TakeNumber(const char* what) {
  const std::string& text = Take(what);
  const auto value = ParseNumber(text);
  if (!value) Fail(std::string("expected ") + what + " instead of '" + text + "'");
  return *value;
}

double LineReader::TakeItemNumber(const char* what, bool* last) {
  const std::string text = Take(what);
  const bool comma = text.ends_with(',');
  const auto value = ParseNumber(std::string_view(text).substr(0, text.size() - (comma ? 1 : 0)));
  if (!value) Fail(std::string("expected ") + what + " instead of '" + text + "'");
  *last = !comma && !TakeIf(",");
  return *value;
}

Eigen::Vector2d LineReader::TakePixel() {
  Expect("pixel");
  const double u = TakeNumber("a pixel's column");
  const double v = TakeNumber("a pixel's row");
  return {u, v};
}

void LineReader::ExpectEnd() {
  if (!AtEnd()) {
    Fail("unexpected '" + words_[next_].text + "'; put a name with spaces in double quotes");
  }
}

void LineReader::Fail(const std::string& what) const {
  throw Error(where_ + ": " + what + ".");
}

void LineReader::Split(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r\f\v";
  for (std::size_t i = 0; i < line.size();) {
    if (kBlank.find(line[i]) != std::string_view::npos) {
      ++i;
    } else if (line[i] == '#') {
      return;
    } else if (line[i] == '"') {
      i = ReadQuoted(line, i + 1);
    } else {
      const std::size_t end = std::min(line.find_first_of(" \t\r\f\v#\"", i), line.size());
      words_.push_back({std::string(line.substr(i, end - i)), false});
      i = end;
    }
  }
}

std::size_t LineReader::ReadQuoted(std::string_view line, std::size_t i) {
  Word word{{}, true};
  for (; i < line.size() && line[i] != '"'; ++i) {
    if (line[i] != '\\') {
      word.text += line[i];
      continue;
    }
    const char escaped = ++i < line.size() ? line[i] : '\0';
    if (escaped != '"' && escaped != '\\' && escaped != 'n') Fail("expected \", \\ or n after a backslash");
    word.text += escaped == 'n' ? '\n' : escaped;
  }
  if (i >= line.size()) Fail("a double quote is not closed");
  words_.push_back(std::move(word));
  return i + 1;
}

}  // namespace docent::app
