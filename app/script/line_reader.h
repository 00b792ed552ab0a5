// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

// Reads the words of one line of a script in order. Throws Error, which names the line, where it is not as
// expected. Single thread.
class LineReader {
 public:
  LineReader(std::string_view line, std::string where) : where_(std::move(where)) { Split(line); }

  bool AtEnd() const { return next_ == words_.size(); }

  const std::string& Take(const char* what) {
    if (AtEnd()) Fail(std::string("expected ") + what + " at the end of the line");
    return words_[next_++].text;
  }
  // Consumes the next word if it is this keyword. A quoted word is never a keyword.
  bool TakeIf(std::string_view keyword) {
    if (AtEnd() || words_[next_].quoted || words_[next_].text != keyword) return false;
    ++next_;
    return true;
  }
  void Expect(std::string_view keyword) {
    if (TakeIf(keyword)) return;
    Fail("expected '" + std::string(keyword) + "'" + (AtEnd() ? " at the end of the line" : Instead()));
  }
  std::string TakeName(const char* what) {
    const std::string& name = Take(what);
    if (name.empty()) Fail(std::string("expected ") + what + " that is not empty");
    return name;
  }
  double TakeNumber(const char* what) {
    const std::string& text = Take(what);
    const auto value = ParseNumber(text);
    if (!value) Fail(std::string("expected ") + what + " instead of '" + text + "'");
    return *value;
  }
  // The next number of a list whose items are separated by commas: `last` becomes true where no comma
  // follows.
  double TakeItemNumber(const char* what, bool* last) {
    const std::string text = Take(what);
    const bool comma = text.ends_with(',');
    const auto value = ParseNumber(std::string_view(text).substr(0, text.size() - (comma ? 1 : 0)));
    if (!value) Fail(std::string("expected ") + what + " instead of '" + text + "'");
    *last = !comma && !TakeIf(",");
    return *value;
  }
  Eigen::Vector2d TakePixel() {
    Expect("pixel");
    const double u = TakeNumber("a pixel's column");
    const double v = TakeNumber("a pixel's row");
    return {u, v};
  }
  void ExpectEnd() {
    if (!AtEnd()) {
      Fail("unexpected '" + words_[next_].text + "'; put a name with spaces in double quotes");
    }
  }
  [[noreturn]] void Fail(const std::string& what) const { throw Error(where_ + ": " + what + "."); }

 private:
  std::string Instead() const { return " instead of '" + words_[next_].text + "'"; }

  void Split(std::string_view line) {
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

  // Returns the index after the closing quote.
  std::size_t ReadQuoted(std::string_view line, std::size_t i) {
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

  struct Word {
    std::string text;
    bool quoted = false;
  };

  std::string where_;
  std::vector<Word> words_;
  std::size_t next_ = 0;
};

}  // namespace docent::app
