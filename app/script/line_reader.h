// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace docent::app {

// Splits a line of a script into words and takes them in order. Blanks separate words, # begins a comment,
// and text in double quotes is one word. Every function but AtEnd and TakeIf throws Error that names the line
// when the line does not continue as expected; `what` says what is expected. One thread.
class LineReader {
 public:
  // where: file and line, for errors.
  LineReader(std::string_view line, std::string where) : where_(std::move(where)) { Split(line); }

  bool AtEnd() const { return next_ == words_.size(); }
  const std::string& Take(const char* what);
  // Consumes the next word if it is this keyword. A quoted word is never a keyword.
  bool TakeIf(std::string_view keyword);
  void Expect(std::string_view keyword);
  std::string TakeName(const char* what);  // not empty
  double TakeNumber(const char* what);
  // The next number of a list whose items are separated by commas: `last` becomes true where no comma
  // follows.
  double TakeItemNumber(const char* what, bool* last);
  Eigen::Vector2d TakePixel();
  void ExpectEnd();
  [[noreturn]] void Fail(const std::string& what) const;

 private:
  struct Word {
    std::string text;
    bool quoted = false;
  };

  void Split(std::string_view line);
  // Returns the index after the closing quote.
  std::size_t ReadQuoted(std::string_view line, std::size_t i);

  std::string where_;
  std::vector<Word> words_;
  std::size_t next_ = 0;
};

}  // namespace docent::app
